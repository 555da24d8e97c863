// The best visit of each cell, by an order-preserving uint key. PASS 0 keeps the least key, PASS 1 the lowest
// item among those that have it, PASS 2 lists the cells that were hit, each at a place of the item that has it: SLOTS
// for each, so that no counter is shared. Two 32-bit passes: 64-bit atomics are not everywhere.
#if PASS == 2 || LISTED
#include "common/list.glsl"
#endif

#if PASS == 0
layout(std430, binding = STORAGE_KEYS) buffer Keys { uint keys[]; };
#else
layout(binding = TEXTURE_KEYS) uniform usamplerBuffer keys;
#endif
#if PASS == 1
layout(std430, binding = STORAGE_BEST) buffer Best { uint best[]; };
#elif PASS == 2
layout(binding = TEXTURE_BEST) uniform usamplerBuffer best;
uint next_slot = item() * uint(SLOTS);
#endif

void visit(uint cell, uint key, uint item_id) {
#if PASS == 0
    atomicMin(keys[cell], key);
#else
#if PASS == 2
    uint slot = next_slot++;
#endif
    if (texelFetch(keys, int(cell)).r != key) return;
#if PASS == 1
    atomicMin(best[cell], item_id);
#else
    if (texelFetch(best, int(cell)).r == item_id) list[slot] = cell;
#endif
#endif
}
