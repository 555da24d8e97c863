// The first of two passes alone (Slomp 2014, Fig. 3c): depth and nothing else, pushed away from the eye, in grey.
#include "surfels/passes/limit.glsl"
#include "common/item.glsl"

layout(std430, binding = STORAGE_DEPTHS) buffer Depths { uint depths[]; };
layout(std430, binding = STORAGE_ROWS) readonly buffer Rows { uint rows[]; };
layout(std430, binding = STORAGE_COLOR) writeonly buffer Color { uint own_colors[]; };
layout(std430, binding = STORAGE_NORMAL) writeonly buffer Normal { float own_normals[]; };

uniform vec2 depth_range;  // light to dark

void main() {
    uint i = item();
    if (i >= uint(view_size.x * view_size.y) || rows[i] == NOTHING) return;
    float depth = linear_depth(limit_behind(uintBitsToFloat(depths[i]), rows[i]));
    depths[i] = floatBitsToUint(depth);
    float t = clamp((depth - depth_range.x) / (depth_range.y - depth_range.x), 0.0, 1.0);
    own_colors[i] = packUnorm4x8(vec4(vec3(0.95 - 0.8 * t), 1.0));
    for (uint k = 0u; k < 3u; ++k) own_normals[3u * i + k] = 0.0;  // unknown: lit as if it faced the eye
}
