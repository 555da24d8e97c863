// What pixels show, as a Surface has it. COLOR, NORMAL, VALUE: which channels there are.
#include "common/color.glsl"
#include "pyramidal/seen.glsl"

layout(std430, binding = STORAGE_DEPTHS) buffer Depths { uint depths[]; };
layout(std430, binding = STORAGE_ROWS) buffer Rows { uint rows[]; };
layout(std430, binding = STORAGE_LEVEL) writeonly buffer Level { uint own_levels[]; };
#if COLOR
layout(std430, binding = STORAGE_COLOR) writeonly buffer Color { uint own_colors[]; };
#endif
#if NORMAL
layout(std430, binding = STORAGE_NORMAL) writeonly buffer Normal { float own_normals[]; };
#endif
#if VALUE
layout(std430, binding = STORAGE_VALUE) writeonly buffer Value { float own_values[]; };
#endif

void store(int i, float depth, uint row, int level, Seen seen) {
    depths[i] = floatBitsToUint(depth);
    rows[i] = row;
    own_levels[i] = uint(level);
#if COLOR
    own_colors[i] = packUnorm4x8(vec4(to_srgb(seen.color), 1.0));
#endif
#if NORMAL
    for (int k = 0; k < 3; ++k) own_normals[3 * i + k] = seen.normal[k];
#endif
#if VALUE
    own_values[i] = seen.value;
#endif
}
