// Larger splats close gaps, but also reach over the outline by as much as they are larger. So what they
// filled is taken back where nothing is shown at that distance: dilated, then eroded.
// Filled pixels are listed and have a negative depth. STEP 0 says which are taken back, reading depths
// alone, which change in STEP 1, so that the order does not matter.
#include "surfels/passes/limit.glsl"
#include "common/item.glsl"
#include "common/list.glsl"

layout(std430, binding = 0) buffer Depths { uint depths[]; };
layout(std430, binding = 1) buffer Rows { uint rows[]; };

uniform float enlarge;

const uint EMPTY = 0x7F800000u;  // +inf
const int DIRECTIONS = 16;
const float SLACK = 0.75;  // pixels that the outline may grow by

bool is_empty(ivec2 pixel) {
    if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, view_size))) return false;
    return depths[pixel.y * view_size.x + pixel.x] == EMPTY;
}

// Whether nothing is shown so far away in some direction.
bool near_outline(vec2 center, float reach) {
    for (int i = 0; i < DIRECTIONS; ++i) {
        float angle = 6.2831853 / DIRECTIONS * i;
        if (is_empty(ivec2(floor(center + reach * vec2(cos(angle), sin(angle)))))) return true;
    }
    return false;
}

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint index = list[i];
    float depth = -uintBitsToFloat(depths[index]);
#if STEP == 0
    float reach = (enlarge - 1.0) * visible_radius(depth, rows[index]) * scale_at(depth) - SLACK;
    vec2 center = vec2(index % view_size.x, index / view_size.x) + 0.5;
    if (reach > 0.0 && near_outline(center, reach)) rows[index] = NONE;
#else
    depths[index] = rows[index] == NONE ? EMPTY : floatBitsToUint(depth);
#endif
}
