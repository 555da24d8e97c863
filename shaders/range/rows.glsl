// Listed tiles, of which each row of samples is an invocation's. Eight bits before a tile's number say which part of it
// the invocation is asked for, from 1 on; 0: for all.
#include "common/list.glsl"
#include "range/tiles.glsl"

layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer listed_tiles;

struct RowOfSamples {
    RangeView view;
    RangeLevel range;
    int number, level, part;
    ivec2 first, last;  // (u, v), and how many there are: last.x - first.x
};

// The i-th listed row; false where the tile has fewer rows.
bool row_of_samples(uint i, out RowOfSamples row) {
    uint word = texelFetch(listed_tiles, int(i) / RANGE_TILE).r;
    int tile = int(word & 0xFFFFFFu);
    row.part = int(word >> 24);
    ivec2 at = level_of_tile(tile, RANGE_COUNT);
    row.number = at.x;
    row.level = at.y;
    row.view = range_view(at.x);
    row.range = range_level(row.view, at.y);
    int columns = (row.range.size.x + RANGE_TILE - 1) / RANGE_TILE, within = tile - row.range.first_tile;
    row.first = RANGE_TILE * split(within, columns) + ivec2(0, int(i) % RANGE_TILE);
    row.last = ivec2(min(row.first.x + RANGE_TILE, row.range.size.x), row.first.y);
    return row.first.y < row.range.size.y;
}
