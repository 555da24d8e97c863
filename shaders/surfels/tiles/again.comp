// Lists the tiles in which a pixel shows a disc that does not reach it, each once, with a dispatch of TILES in a work
// group.
#include "surfels/tiles/nearest.glsl"

layout(binding = TEXTURE_DISCS) uniform usamplerBuffer discs;  // of each row
layout(std430, binding = STORAGE_FARTHEST) buffer Flags { uint flags[]; };  // 1: the tile is listed
layout(std430, binding = STORAGE_AGAIN) buffer Again { uint groups_x, groups_y, groups_z, again_count, again[]; };

void main() {
    int tile = this_tile();
    if (tile < 0) return;
    bool changes = false;
    for (int k = 0; k < PIXELS; ++k) {
        uint row = in_picture(k) ? rows[index_of(k)] : NOTHING;
        if (row == NOTHING) continue;
        begin_columns(texelFetch(discs, int(row)).r);
        float y = down_at(k);
        changes = changes || !is_inside(form_at(k, y), key_at(k, y));
    }
    if (!changes || atomicExchange(flags[tile], 1u) == 1u) return;
    uint at = atomicAdd(again_count, 1u), groups = (at + uint(TILES)) / uint(TILES);
    again[at] = uint(tile);
    atomicMax(groups_x, min(groups, 1024u));
    atomicMax(groups_y, (groups + 1023u) / 1024u);
}
