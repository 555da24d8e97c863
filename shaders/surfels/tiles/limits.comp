// The farthest depth in each tile at which a splat still counts in the second pass; +inf where a pixel shows
// nothing. An invocation goes down a column of a tile.
#include "surfels/passes/limit.glsl"
#include "surfels/tiles/grid.glsl"
#include "common/item.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
layout(std430, binding = STORAGE_FARTHEST) buffer Farthest { uint farthest[]; };

void main() {
    int i = int(item()), x = i % view_size.x, tile = i / view_size.x;
    if (tile >= tiles.y) return;
    float most = 0.0;
    for (int y = tile * TILE; y < min((tile + 1) * TILE, view_size.y); ++y) {
        int index = y * view_size.x + x;
        uint row = texelFetch(rows, index).r;
        float depth = uintBitsToFloat(texelFetch(depths, index).r);  // +inf where nothing is
        most = max(most, row == NOTHING ? depth : depth + epsilon * visible_radius(depth, row));
    }
    atomicMax(farthest[tile * tiles.x + x / TILE], floatBitsToUint(most));
}
