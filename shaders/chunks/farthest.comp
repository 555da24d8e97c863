// The farthest depth of each tile of pixels, +inf where one shows nothing.
#include "common/item.glsl"
#include "common/view.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;  // float bits
layout(std430, binding = STORAGE_FARTHEST_TILES) writeonly buffer Farthest { uint farthest[]; };

void main() {
    int tile = int(item()), across = (view_size.x + TILE - 1) / TILE;
    if (tile >= int(item_count)) return;
    ivec2 first = ivec2(tile % across, tile / across) * TILE, last = min(first + TILE, view_size);
    uint far = 0u;
    for (int y = first.y; y < last.y && far < NO_DEPTH; ++y)
        for (int x = first.x; x < last.x; ++x)
            far = max(far, texelFetch(depths, y * view_size.x + x).r);
    farthest[tile] = far;
}
