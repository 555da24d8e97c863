// The mean of the splats that a pixel shows, or that lie at most so far behind: for splats of about a pixel, where
// the nearest alone would flicker. STEP 0: the sums of listed pixels are set to zero; 1: once splats are added
// (surfels/passes/averaged.glsl), sums become means. They are of how many there are, normals and linear light;
// of more than MOST they are nothing.
#include "common/view.glsl"
#include "common/item.glsl"
#include "common/list.glsl"
#include "common/split.glsl"
#include "scatter/sums.glsl"
#include "surfels/passes/look.glsl"
#include <params>

layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
layout(std430, binding = STORAGE_NORMAL) writeonly buffer Normal { float own_normals[]; };
#if HAS_COLORS
layout(std430, binding = STORAGE_COLOR) writeonly buffer Color { uint own_colors[]; };
#endif

// Three of a cell's sums, from the k-th on: whole numbers, in steps of one.
ivec3 sums_from(uint cell, uint k) {
    uint at = CHANNELS * cell + k;
    return ivec3(sums[at], sums[at + 1u], sums[at + 2u]);
}

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint cell = list[i];
#if STEP == 0
    for (uint k = 0u; k < CHANNELS; ++k) sums[CHANNELS * cell + k] = 0;
#else
    // The shown splat passes, unless two programs round apart: then it is alone.
    int count = sums[CHANNELS * cell];
    float mean = count == 0 || count > MOST ? 0.0 : mean_share;
    uint divisor = uint(max(count, 1));
    uvec2 look = texelFetch(looks, int(texelFetch(rows, int(cell)).r)).xy;
#if HAS_COLORS
    vec3 light = means_of(sums_from(cell, 4u), divisor);
    own_colors[cell] = packUnorm4x8(vec4(srgb_of_light(mix(light_of(look), light, mean)), 1.0));
#endif
    vec3 normal = means_of(sums_from(cell, 1u), divisor);
    normal = mix(normal_of(look) / NORMAL_STEPS, normal / max(length(normal), 1e-6), mean);
    for (uint k = 0u; k < 3u; ++k) own_normals[3u * cell + k] = normal[k];
#endif
}
