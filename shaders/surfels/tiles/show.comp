// The nearest disc at each pixel of a tile. FARTHEST: also the farthest depth that the tile then shows.
#include "surfels/tiles/nearest.glsl"

#if FARTHEST
layout(std430, binding = 2) buffer Farthest { uint farthest[]; };
#endif

void main() {
    int tile = this_tile();
    begin_pixels();
    take_nearest(part_of(tile), false);
    if (tile < 0) return;
    for (int k = 0; k < ROWS; ++k)
        if (in_picture(k)) store_pixel(k);
#if FARTHEST
    uint most = 0u;
    for (int k = 0; k < ROWS; ++k)
        if (in_picture(k)) most = max(most, depth_bits(k));
    atomicMax(farthest[tile], most);
#endif
}
