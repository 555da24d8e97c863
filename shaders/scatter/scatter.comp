// Scatter: items go to cells. A file with `scatter(i)` says which an item visits; what becomes of a visit
// says another: the best per cell (scatter/best.glsl), sums (scatter/sums.glsl), a list (bins/lists.glsl).
// ITEMS: how many there are; list_count: as a list has, which the first file then includes.
// WIDE: cells are 64-bit words. TOGETHER: `scatter(i, exists)` runs in all invocations of a work group, which can so wait for
// each other.
#ifdef WIDE
#extension GL_ARB_gpu_shader_int64 : require
#extension GL_NV_shader_atomic_int64 : require
#endif
#include "common/item.glsl"

#include <target>
#include <cells>

void main() {
    uint i = item();
#if TOGETHER
    scatter(i, i < ITEMS);
#else
    if (i < ITEMS) scatter(i);
#endif
}
