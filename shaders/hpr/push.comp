// What pixels show once all levels are pushed: the points' own, and between them what the levels gave.
#include "common/item.glsl"
#include "common/color.glsl"

layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
layout(binding = TEXTURE_SAMPLES) uniform samplerBuffer samples;  // as hpr/pull.comp has them
layout(binding = TEXTURE_WEIGHTS) uniform samplerBuffer weights;
layout(binding = TEXTURE_DETAIL) uniform samplerBuffer look_samples;
#if HAS_COLORS
layout(binding = TEXTURE_COLORS) uniform samplerBuffer color_samples;
layout(std430, binding = STORAGE_COLOR) writeonly buffer Color { uint own_colors[]; };
#endif
#if HAS_VALUES
layout(std430, binding = STORAGE_VALUE) writeonly buffer Value { float own_values[]; };
#endif
layout(std430, binding = STORAGE_DEPTHS) writeonly buffer Depths { uint depths[]; };
layout(std430, binding = STORAGE_LEVEL) writeonly buffer Level { uint own_levels[]; };
layout(std430, binding = STORAGE_NORMAL) writeonly buffer Normal { float own_normals[]; };

void main() {
    uint i = item();
    if (i >= item_count || texelFetch(weights, int(i)).r <= 0.0) return;
    vec4 known = texelFetch(samples, int(i)), look = texelFetch(look_samples, int(i));
    bool filled = texelFetch(rows, int(i)).r == NOTHING;
    if (filled) depths[i] = floatBitsToUint(known.x);
    own_levels[i] = filled ? uint(max(ceil(known.w), 1.0)) : 0u;
    for (uint k = 0u; k < 3u; ++k) own_normals[3u * i + k] = look[k];
#if HAS_COLORS
    own_colors[i] = packUnorm4x8(vec4(to_srgb(texelFetch(color_samples, int(i)).rgb), 1.0));
#endif
#if HAS_VALUES
    own_values[i] = look.w;
#endif
}
