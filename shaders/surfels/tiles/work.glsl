// Lists the tiles that discs reach, with a dispatch of TILES in a work group. ALL: all tiles where some discs, which reach
// anywhere, are rasterised or were sent to their pixels. SECOND: of a second filling. REST: those that discs of the first
// one alone reach, once the others are listed, and where a pixel shows nothing.
#include "surfels/tiles/filled.glsl"

layout(std430, binding = STORAGE_STARTS) readonly buffer Starts { uint starts[]; };
layout(std430, binding = STORAGE_WORK) writeonly buffer Work { uint groups_x, groups_y, groups_z, work_count, work[]; };
layout(std430, binding = STORAGE_FARTHEST) buffer Farthest { uint farthest[]; };

#if REST
layout(binding = TEXTURE_STARTS) uniform usamplerBuffer first_starts;

bool has_first(uint tile) {
    return texelFetch(first_starts, int(tile) + 1).r > texelFetch(first_starts, int(tile)).r;
}
#endif

uint entries_of(uint tile) { return starts[tile + 1u] - starts[tile]; }

uint word_of(uint tile) {
    bool is_reached = entries_of(tile) > 0u;
#if ALL
    is_reached = is_reached || fillings[0].large_count + fillings[0].sent > 0u;
#endif
#if REST
    is_reached = !is_reached && has_first(tile) && farthest[tile] == NO_DEPTH;
#endif
    return is_reached ? 1u : 0u;
}

void take_sum(uint tile, uint sum) {
    uint is_worked = word_of(tile);
    if (is_worked > 0u) work[sum] = tile;
#if !REST
    uint entries = entries_of(tile);
#if SECOND
    if (entries > 0u) farthest[tile] = 0u;  // is shown again
#else
    farthest[tile] = is_worked > 0u ? 0u : NO_DEPTH;  // through such a tile everything is seen
#endif
    if (entries > fillings[SECOND].longest) atomicMax(fillings[SECOND].longest, entries);
#endif
    if (tile + 1u < word_count) return;
    fillings[SECOND].list_length = starts[word_count];
    uint listed = sum + is_worked, groups = (listed + TILES - 1u) / TILES;
    work_count = listed;
    groups_x = min(groups, 1024u);
    groups_y = (groups + 1023u) / 1024u;
    groups_z = 1u;
}
