// The best visit of each cell, by an order-preserving uint key. PASS 0 keeps the least key, PASS 1 the lowest
// item among those that have it. Two 32-bit passes: 64-bit atomics are not everywhere. Where they are, WIDE does both at
// once: what is no better than what a cell has sends no atomic.
// LISTS: the cells that were hit are listed, in slots that each item has for its visits: they need no counter that all
// share. A cell is listed more than once where several items have its key.
#if LISTED
#include "common/list.glsl"
#endif

#ifdef WIDE
layout(std430, binding = STORAGE_KEYS) buffer Wide { uint64_t wide[]; };
#elif PASS == 0
layout(std430, binding = STORAGE_KEYS) buffer Keys { uint keys[]; };
#else
layout(binding = TEXTURE_KEYS) uniform usamplerBuffer keys;
layout(std430, binding = STORAGE_BEST) buffer Best { uint best[]; };
#if LISTS
layout(std430, binding = STORAGE_HITS) writeonly buffer Hits { uint hits[]; };
uniform uint slots;  // of each item
uint next_slot = item() * slots;
#endif
#endif

void visit(uint cell, uint key, uint item_id) {
#ifdef WIDE
    uint64_t both = uint64_t(key) << 32 | uint64_t(item_id);
    if (wide[cell] > both) atomicMin(wide[cell], both);
#elif PASS == 0
    atomicMin(keys[cell], key);
#else
#if LISTS
    uint slot = next_slot++;
#endif
    if (texelFetch(keys, int(cell)).r != key) return;
    atomicMin(best[cell], item_id);
#if LISTS
    hits[slot] = cell;
#endif
#endif
}
