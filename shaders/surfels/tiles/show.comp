// The nearest disc at each pixel of a tile. FARTHEST: also the farthest depth that the tile then shows.
// FILL: only where nothing was shown; such pixels are listed for surfels/passes/close.comp, and
// their depth is negative until then.
#include "surfels/tiles/nearest.glsl"

#if FARTHEST
layout(std430, binding = STORAGE_FARTHEST) buffer Farthest { uint farthest[]; };
#elif FILL
#include "common/list.glsl"
#endif

void main() {
    int tile = this_tile();
    begin_pixels();
    ivec2 part = part_of(tile);
#if FILL
    bool all_closed = true;
    for (int k = 0; k < ROWS; ++k) all_closed = all_closed && best[k] == CLOSED;
    if (all_closed) part = ivec2(0);
#endif
    take_nearest(part);
    if (tile < 0) return;
#if FILL
    for (int k = 0; k < ROWS; ++k)
        if (best[k] != CLOSED && shown[k] != NOTHING) {
            depths[index_of(k)] = floatBitsToUint(-linear_depth(best[k]));
            rows[index_of(k)] = shown[k];
            list[reserve(1u)] = uint(index_of(k));
        }
#else
    for (int k = 0; k < ROWS; ++k)
        if (in_picture(k)) store_pixel(k);
#endif
#if FARTHEST
    uint most = 0u;
    for (int k = 0; k < ROWS; ++k)
        if (in_picture(k)) most = max(most, depth_bits(k));
    atomicMax(farthest[tile], most);
#endif
}
