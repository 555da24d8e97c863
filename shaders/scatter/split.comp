// Splits 64-bit cells of a scatter into the least key of each and, where it is the LAST time, the item that has it. Cells are
// clear again then.
#include "common/item.glsl"

layout(std430, binding = STORAGE_KEYS) buffer Wide { uvec2 wide[]; };  // item, key
layout(std430, binding = STORAGE_BEST) writeonly buffer Best { uint best[]; };
layout(std430, binding = STORAGE_SPLIT_KEYS) writeonly buffer Keys { uint keys[]; };

void main() {
    uint cell = item();
    if (cell >= item_count) return;
    uvec2 both = wide[cell];
    keys[cell] = both.y;
#if LAST
    best[cell] = both.x;
    wide[cell] = uvec2(NOTHING, NO_DEPTH);
#endif
}
