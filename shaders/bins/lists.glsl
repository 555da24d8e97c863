// A list of the visits of each cell. PASS 0 counts them; PASS 1 writes them down: anywhere in their cell's part, or,
// ORDERED, as pairs that are sorted by cell afterwards. `visit` gives where the item then stands, but where that is not
// known yet.
#if PASS == 0
layout(std430, binding = STORAGE_CURSORS) buffer Counts { uint counts[]; };
#else
layout(std430, binding = STORAGE_CURSORS) buffer Cursors { uint cursors[]; };  // of cells; ORDERED: of items
#endif
#if PASS == 0 && ORDERED
layout(std430, binding = STORAGE_VISITS) writeonly buffer Visits { uint visits[]; };
uint visited = 0u;
#elif PASS == 1 && ORDERED
layout(std430, binding = STORAGE_VISITS) writeonly buffer Pairs { uvec2 pairs[]; };
#elif PASS == 1
layout(std430, binding = STORAGE_VISITS) writeonly buffer Entries { uint entries[]; };
#endif

uint visit(uint cell, uint key, uint item_id) {
#if PASS == 0
    atomicAdd(counts[cell], 1u);
#if ORDERED
    visits[item()] = ++visited;
#endif
    return 0u;
#elif ORDERED
    uint at = cursors[item()]++;
    if (at < uint(pairs.length())) pairs[at] = uvec2(cell, item_id);
    return 0u;
#else
    uint at = atomicAdd(cursors[cell], 1u);
    if (at < uint(entries.length())) entries[at] = item_id;
    return at;
#endif
}
