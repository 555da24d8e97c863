// Points of a cloud. SAMPLED: a list says which.
#include "common/view.glsl"
#include "common/color.glsl"
#include <params>

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;
#endif
#if SUMS
layout(binding = TEXTURE_COLORS) uniform samplerBuffer colors;

vec3 color_of_item(uint row) { return to_linear(texelFetch(colors, int(row)).rgb); }
#endif
#include "pyramidal/placing.glsl"

void scatter(uint i) {
#if SAMPLED
    i = texelFetch(drawn_rows, int(i)).r;
#endif
    vec3 place = to_view(texelFetch(positions, int(i)).xyz);
    vec2 pixel = to_pixel(place);
    if (in_depth_range(-place.z) && all(lessThan(abs(pixel), vec2(1e6)))) place_sample(pixel, -place.z, i);
}
