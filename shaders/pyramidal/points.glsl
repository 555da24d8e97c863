// A point goes to the pixel that it lies in, by its depth. SAMPLED: a list says which points.
#include "common/view.glsl"

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;
#endif

void scatter(uint i) {
#if SAMPLED
    i = texelFetch(drawn_rows, int(i)).r;
#endif
    vec3 place = to_view(texelFetch(positions, int(i)).xyz);
    float depth = -place.z;
    vec2 pixel = to_pixel(place);
    if (!in_depth_range(depth)) return;
    if (any(lessThan(pixel, vec2(0.0))) || any(greaterThanEqual(pixel, vec2(view_size)))) return;
    visit(uint(int(pixel.y) * view_size.x + int(pixel.x)), floatBitsToUint(depth), i);
}
