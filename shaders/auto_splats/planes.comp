// Two depths for each coarse cell: how far points are near, a cell's sides behind the nearest that it sees (Preiner
// 2012, 7); and how far points take part that others hide, a side behind the farthest of the first around.
#include "common/item.glsl"
#include "common/split.glsl"
#include "auto_splats/place.glsl"

layout(binding = TEXTURE_KEYS) uniform usamplerBuffer nearest;  // depth bits; NO_DEPTH: nothing
layout(std430, binding = STORAGE_NEAR_TO) writeonly buffer NearTo { float near_to[]; };
layout(std430, binding = STORAGE_FARTHEST) writeonly buffer Farthest { float farthest[]; };

const float SIDES = 2.0;

// How far behind a depth, in sides of cells.
float behind(float depth, float sides) { return depth + sides * float(1 << coarse_shift) / scale_at(depth); }

float nearest_of(ivec2 cell) {
    bool there = all(greaterThanEqual(cell, ivec2(0))) && all(lessThan(cell, coarse_size));
    uint bits = there ? texelFetch(nearest, cell.y * coarse_size.x + cell.x).r : NO_DEPTH;
    return bits == NO_DEPTH ? 0.0 : uintBitsToFloat(bits);
}

void main() {
    uint i = item();
    if (i >= item_count) return;
    ivec2 cell = split(int(i), coarse_size.x);
    float most = 0.0;
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) most = max(most, nearest_of(cell + ivec2(x, y)));
    near_to[i] = behind(nearest_of(cell), SIDES);
    farthest[i] = most > 0.0 ? behind(most, SIDES + 6.0) : 0.0;
}
