// The mean of the splats that a pixel shows, or that lie at most so far behind: for splats of about a pixel, where
// the nearest alone would flicker, and a mask's shape cannot be seen. All count the same, as whole numbers, so that sums
// do not depend on the order; NORMAL_DIVISOR and COLOR_DIVISOR keep them in range. STEP 0: listed pixels are set to
// zero; 1: each splat is added to its pixels; 2: sums become means, in place.
#include "common/view.glsl"
#include "common/item.glsl"
#include "surfels/passes/limit.glsl"
#include "surfels/passes/look.glsl"

layout(std430, binding = STORAGE_SUMS) buffer Sums { uint sums[]; };  // red, green, blue and how many of each pixel
layout(std430, binding = STORAGE_NORMAL) buffer Normal { int normal_sums[]; };  // Surface.own
layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;

#if STEP == 1
void visit(uint cell, uint key, uint item_id) {
    uint row = texelFetch(rows, int(cell)).r;
    if (row == NOTHING) return;  // two programs round apart at a splat's border
    float depth = uintBitsToFloat(texelFetch(depths, int(cell)).r);
    if (uintBitsToFloat(key) > depth + epsilon * visible_radius(depth, row)) return;
    uvec2 look = texelFetch(looks, int(item_id)).xy, shown = texelFetch(looks, int(row)).xy;
    vec3 n = normal_of(look);
    ivec3 normal = ivec3(turned(1.0, n, normal_of(shown)) * n) / NORMAL_DIVISOR;
#if HAS_COLORS
    uvec3 color = uvec3(color_of(look)) / COLOR_DIVISOR;
    for (int k = 0; k < 3; ++k) atomicAdd(sums[4u * cell + uint(k)], color[k]);
#endif
    atomicAdd(sums[4u * cell + 3u], 1u);
    for (int k = 0; k < 3; ++k) atomicAdd(normal_sums[3u * cell + uint(k)], normal[k]);
}

#include "surfels/scatter.glsl"

void main() {
    uint i = item();
    if (i < item_count) scatter(i);
}
#else
#include "common/list.glsl"
#if HAS_COLORS
layout(std430, binding = STORAGE_COLOR) writeonly buffer Color { uint own_colors[]; };
#endif

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint cell = list[i];
#if STEP == 0
    for (uint k = 0u; k < 4u; ++k) sums[4u * cell + k] = 0u;
    for (uint k = 0u; k < 3u; ++k) normal_sums[3u * cell + k] = 0;
#else
    // The shown splat passes, unless two programs round apart: then it is alone.
    uint count = sums[4u * cell + 3u];
    float mean = count == 0u ? 0.0 : mean_share;
    uvec2 look = texelFetch(looks, int(texelFetch(rows, int(cell)).r)).xy;
#if HAS_COLORS
    vec3 color = vec3(sums[4u * cell], sums[4u * cell + 1u], sums[4u * cell + 2u]) / float(max(count, 1u));
    color *= float(COLOR_DIVISOR);
    own_colors[cell] = packUnorm4x8(vec4(mix(color_of(look), color, mean) / 255.0, 1.0));
#endif
    vec3 sum = vec3(normal_sums[3u * cell], normal_sums[3u * cell + 1u], normal_sums[3u * cell + 2u]);
    sum = mix(normal_of(look) / 511.0, sum / max(length(sum), 1e-6), mean);
    for (uint k = 0u; k < 3u; ++k) normal_sums[3u * cell + k] = floatBitsToInt(sum[k]);
#endif
}
#endif
