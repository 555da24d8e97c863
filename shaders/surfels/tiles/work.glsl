// Lists the tiles that discs reach, with a dispatch of TILES in a work group: all tiles where some discs, which reach
// anywhere, are rasterised or were sent to their pixels. SECOND: of a second filling; BOTH: those that discs of the
// first one reach, too.
layout(std430, binding = STORAGE_STARTS) readonly buffer Starts { uint starts[]; };
layout(std430, binding = STORAGE_LARGE) buffer Large { uint large_count, list_length, away, longest, sent, large[]; };
layout(std430, binding = STORAGE_WORK) writeonly buffer Work { uint groups_x, groups_y, groups_z, work_count, work[]; };
layout(std430, binding = STORAGE_FARTHEST) writeonly buffer Farthest { uint farthest[]; };

#if BOTH
layout(binding = TEXTURE_STARTS) uniform usamplerBuffer first_starts;
#endif

uint entries_of(uint tile) {
    uint entries = starts[tile + 1u] - starts[tile];
#if BOTH
    entries += texelFetch(first_starts, int(tile) + 1).r - texelFetch(first_starts, int(tile)).r;
#endif
    return entries;
}

uint word_of(uint tile) { return entries_of(tile) > 0u || large_count > 0u || sent > 0u ? 1u : 0u; }

void take_sum(uint tile, uint sum) {
    uint entries = entries_of(tile), is_worked = word_of(tile);
    if (is_worked > 0u) work[sum] = tile;
#if SECOND
    if (entries > 0u) farthest[tile] = 0u;  // is shown again
#else
    farthest[tile] = is_worked > 0u ? 0u : NO_DEPTH;  // through such a tile everything is seen
#endif
    if (entries > longest) atomicMax(longest, entries);
    if (tile + 1u < word_count) return;
    list_length = starts[word_count];
    uint listed = sum + is_worked, groups = (listed + TILES - 1u) / TILES;
    work_count = listed;
    groups_x = min(groups, 1024u);
    groups_y = (groups + 1023u) / 1024u;
    groups_z = 1u;
}
