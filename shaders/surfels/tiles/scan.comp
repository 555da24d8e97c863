// Counts become where each tile's part of the list starts; lists the tiles that have one, with a
// dispatch of TILES in a work group: all tiles where large discs, which reach anywhere, are rasterised.
// One work group.
#include "surfels/tiles/grid.glsl"

layout(local_size_x = 256) in;

layout(std430, binding = 0) buffer Slots { uint slots[]; };
layout(std430, binding = 1) buffer Large { uint large_count, list_length, away, longest, large[]; };
layout(std430, binding = 2) writeonly buffer Work { uint groups_x, groups_y, groups_z, work_count, work[]; };
layout(std430, binding = 3) writeonly buffer Farthest { uint farthest[]; };

uint is_worked(uint entries) { return entries > 0u || large_count > 0u ? 1u : 0u; }

shared uvec2 sums[256];  // entries, tiles

void main() {
    uint me = gl_LocalInvocationID.x, slot_count = uint(tiles.x * tiles.y);
    uint run = (slot_count + 255u) / 256u;
    uint first = min(me * run, slot_count), last = min(first + run, slot_count);
    uvec2 sum = uvec2(0u);
    uint most = 0u;
    for (uint i = first; i < last; ++i) {
        sum += uvec2(slots[i], is_worked(slots[i]));
        most = max(most, slots[i]);
    }
    atomicMax(longest, most);
    sums[me] = sum;
    barrier();
    for (uint step = 1u; step < 256u; step *= 2u) {
        uvec2 before = me >= step ? sums[me - step] : uvec2(0u);
        barrier();
        sums[me] += before;
        barrier();
    }
    uvec2 start = sums[me] - sum;
    for (uint i = first; i < last; ++i) {
        uint count = slots[i];
        slots[i] = start.x;
        if (is_worked(count) > 0u) work[start.y] = i;
        farthest[i] = count > 0u ? 0u : 0x7F800000u;  // +inf: through such a tile everything is seen
        start += uvec2(count, is_worked(count));
    }
    if (me != 255u) return;
    list_length = start.x;
    work_count = start.y;
    uint groups = (start.y + TILES - 1u) / TILES;
    groups_x = min(groups, 1024u);
    groups_y = (groups + 1023u) / 1024u;
    groups_z = 1u;
}
