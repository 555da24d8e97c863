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
    sight = vec3(turned.yz / turned.x, length(spot));
    return turned.x > 0.0;
#else
    sight = spot;
    return true;
#endif
}

// How far a point lies before another, over its own distance.
float depth_before(vec3 sight, vec3 other) {
#if CUBE
    return (other.z - sight.z) / sight.z;
#else
    return (other.z - sight.z) / (1.0 / lateral + tangent * sight.z);
#endif
}

// The sine of the angle between two points.
float angle_between(vec3 sight, vec3 other) {
    vec2 apart = other.xy - sight.xy;
    float turn = tangent * (sight.x * apart.y - sight.y * apart.x), t2 = tangent * tangent;
    float lengths = (1.0 + t2 * dot(sight.xy, sight.xy)) * (1.0 + t2 * dot(other.xy, other.xy));
    return sqrt((dot(apart, apart) + turn * turn) / lengths);
}
