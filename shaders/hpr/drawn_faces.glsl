// Faces as the picture shows them.
#include "common/view.glsl"
#include "common/triangle.glsl"
#include "hpr/faces.glsl"

layout(binding = TEXTURE_SPACINGS) uniform samplerBuffer spacings;  // by row: distance to the neighbours

uniform float longest;  // edge of a face, spacings

// A face's corners in the picture.
struct Drawn {
    vec2 pixels[3];
    vec3 depths;
    vec2 low, high;  // pixel coordinates that hold it
    bool there;      // before the eye, with a place in the picture
};

Drawn drawn_face(uvec3 rows) {
    Drawn face;
    face.low = vec2(1e9);
    face.high = vec2(-1e9);
    face.there = true;
    for (int k = 0; k < 3; ++k) {
        vec3 view = to_view(texelFetch(positions, int(rows[k])).xyz);
        face.depths[k] = -view.z;
        face.pixels[k] = to_pixel(view);
        face.there = face.there && in_depth_range(-view.z) && all(lessThan(abs(face.pixels[k]), vec2(1e6)));
        face.low = min(face.low, face.pixels[k]);
        face.high = max(face.high, face.pixels[k]);
    }
    return face;
}

// First pixel, and the one after the last, whose centres it may hold.
ivec4 pixels_in(Drawn face) {
    return ivec4(max(ivec2(ceil(face.low - 0.5)), ivec2(0)), min(ivec2(floor(face.high + 0.5)), view_size));
}

// Whether no edge is longer than points are apart at either of its ends allows: of surfaces one behind the other it is.
bool is_surface(uvec3 rows) {
    for (int k = 0; k < 3; ++k) {
        uint a = rows[k], b = rows[(k + 1) % 3];
        float spacing = min(texelFetch(spacings, int(a)).r, texelFetch(spacings, int(b)).r);
        if (!(apart_in_space(a, b) <= longest * spacing)) return false;
    }
    return true;
}
