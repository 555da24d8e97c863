// Scatter: items go to cells. A file with `scatter(i)` says which an item visits; what becomes of a visit
// says another: the best per cell (scatter/best.glsl), sums (scatter/sums.glsl), a list (bins/lists.glsl).
#include "common/item.glsl"

#include <target>
#include <cells>

void main() {
    uint i = item();
    if (i < item_count) scatter(i);
}
