// Visible points go to the pixel that they lie in: those that are a corner of a face behind all faces, since these reach
// the centres of pixels around, or of none.
#include "common/view.glsl"

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
layout(binding = TEXTURE_VISIBLE) uniform usamplerBuffer visible;
layout(binding = TEXTURE_JOINED) uniform usamplerBuffer joined;
layout(binding = TEXTURE_SPLATS) uniform usamplerBuffer splats;
layout(binding = TEXTURE_HOMES) uniform usamplerBuffer homes;

uniform int first_point;  // the number of the first point, behind those of all faces

void scatter(uint i) {
    int row = int(i);
    if (texelFetch(visible, row).r == 0u) return;
    // Of several in one sector there is one candidate, which stands for all of them.
    bool stands = texelFetch(splats, row).y != 0u || texelFetch(homes, row).r == NOTHING;
    vec3 view = to_view(texelFetch(positions, row).xyz);
    vec2 pixel = to_pixel(view);
    if (!stands || !in_depth_range(-view.z)) return;
    if (any(lessThan(pixel, vec2(0.0))) || any(greaterThanEqual(pixel, vec2(view_size)))) return;
    ivec2 at = ivec2(pixel);
    uint behind = texelFetch(joined, row).r != 0u ? BEHIND_FACES : 0u;
    visit(uint(at.y * view_size.x + at.x), floatBitsToUint(-view.z) | behind, uint(first_point) + i);
}
