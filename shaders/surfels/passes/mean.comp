// The mean of the splats that a pixel shows, or that lie at most so far behind: for splats of about a pixel, where
// the nearest alone would flicker. STEP 0: the sums of listed pixels are set to zero; 1: once splats are added
// (surfels/passes/averaged.glsl), sums become means. They are of how many there are, normals and linear light;
// of more than MOST they are nothing.
#include "common/view.glsl"
#include "common/item.glsl"
#include "common/list.glsl"
#include "scatter/sums.glsl"
#include "surfels/passes/look.glsl"
#include <params>

layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
layout(std430, binding = STORAGE_NORMAL) writeonly buffer Normal { float own_normals[]; };
#if HAS_COLORS
layout(std430, binding = STORAGE_COLOR) writeonly buffer Color { uint own_colors[]; };
#endif

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint cell = list[i];
#if STEP == 0
    for (uint k = 0u; k < CHANNELS; ++k) sums[CHANNELS * cell + k] = 0;
#else
    // The shown splat passes, unless two programs round apart: then it is alone.
    float count = sum_of(cell, 0u);
    float mean = count == 0.0 || count > MOST ? 0.0 : mean_share;
    uvec2 look = texelFetch(looks, int(texelFetch(rows, int(cell)).r)).xy;
#if HAS_COLORS
    vec3 light = vec3(sum_of(cell, 4u), sum_of(cell, 5u), sum_of(cell, 6u)) / max(count, 1.0);
    own_colors[cell] = packUnorm4x8(vec4(srgb_of_light(mix(light_of(look), light, mean), 1.0), 1.0));
#endif
    vec3 sum = vec3(sum_of(cell, 1u), sum_of(cell, 2u), sum_of(cell, 3u));
    sum = mix(normal_of(look) / NORMAL_STEPS, sum / max(length(sum), 1e-6), mean);
    for (uint k = 0u; k < 3u; ++k) own_normals[3u * cell + k] = sum[k];
#endif
}
