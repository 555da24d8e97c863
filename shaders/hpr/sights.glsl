// How points lie to each other as the eye sees them, in angles over that of half a face, as far as they are small.
#include "hpr/sectors.glsl"

int face_at(vec3 spot) {
#if CUBE
    return face_of(spot);
#else
    return 0;
#endif
}

// Tangents to the right and down on a face, and how far from the eye; whether that is ahead of the face.
bool find_sight(vec3 spot, int face, out vec3 sight) {
#if CUBE
    vec3 turned = to_face(spot, face);
    precise vec2 tangents = turned.yz / turned.x;
    sight = vec3(tangents, length(spot));
    return turned.x > 0.0;
#else
    sight = spot;
    return true;
#endif
}

// A depth that a length beside the eye's ray takes up at this depth, as sights have both.
float depth_unit(float far) { return CUBE == 1 ? far : 1.0 / lateral + tangent * far; }
