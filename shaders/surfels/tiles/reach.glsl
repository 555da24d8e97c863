// Which parts of tiles a disc reaches, and which of all cells are tiles, and homes: the tiles that discs begin in.
#include "surfels/tiles/grid.glsl"

// Parts of tiles that a disc reaches, the first and the one after the last, in two words; the second is 0 where none.
uvec2 packed_parts(ivec4 parts) { return uvec2(parts.xz | parts.yw << 16); }

ivec4 unpacked_parts(uvec2 words) { return ivec4(words & 0xFFFFu, words >> 16).xzyw; }

ivec4 tiles_of(ivec4 parts) { return ivec4(parts.xy / PARTS, (parts.zw + PARTS - 1) / PARTS); }

uint cell_of(ivec2 tile) { return uint(tile.y * tiles.x + tile.x); }

uint home_of(ivec2 tile) { return uint(tiles.x * tiles.y) + cell_of(tile); }

// The one after a tile of those from the first to before the last; below them after the last.
ivec2 next_tile(ivec2 tile, ivec4 t) { return tile.x + 1 < t.z ? ivec2(tile.x + 1, tile.y) : ivec2(t.x, tile.y + 1); }
