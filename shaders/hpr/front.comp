// How far from the eye points may be hidden by others, for each cell: behind all of those that are nearest in it and in
// the cells around, by ROOM of its widths at least; nowhere where one of these has no point.
#include "common/item.glsl"
#include "hpr/sights.glsl"

layout(binding = TEXTURE_KEYS) uniform usamplerBuffer keys;
layout(std430, binding = STORAGE_LIMITS) writeonly buffer Limits { float limits[]; };

void main() {
    uint cell = item();
    if (cell >= item_count) return;
    ivec3 place = place_of(cell);
    float farthest = -1e38;
    for (int n = 0; n < 9; ++n) {
        uint neighbor = neighbor_at(place, ivec2(n % 3 - 1, n / 3 - 1));
        uint key = neighbor == NOTHING ? NO_DEPTH : texelFetch(keys, int(neighbor)).r;
        farthest = max(farthest, key == NO_DEPTH ? 1e38 : key_from(key));
    }
    limits[cell] = farthest < 1e38 ? farthest + ROOM * sector_size() * depth_unit(farthest) : farthest;
}
