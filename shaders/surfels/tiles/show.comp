// The nearest disc at each pixel of a tile. FARTHEST 1: also the farthest depth that the tile then shows; 2: the farthest
// at which a splat still counts there in a second pass.
// FILL: only where nothing was shown; such pixels are listed for surfels/passes/close.comp, and
// their depth is negative until then.
#include "surfels/tiles/nearest.glsl"
#if FARTHEST == 2
#include "surfels/passes/limit.glsl"
#endif

#if FILL && LARGE
layout(binding = TEXTURE_LARGE_ROWS) uniform usampler2D large_rows;
layout(binding = TEXTURE_LARGE_DEPTHS) uniform sampler2D large_depths;  // negative, as surfels/passes/fill.frag has it

uint filled_row(ivec2 at, out float depth) {
    depth = -texelFetch(large_depths, at, 0).r;
    return texelFetch(large_rows, at, 0).r;
}
#endif

#if FARTHEST
layout(std430, binding = STORAGE_FARTHEST) buffer Farthest { uint farthest[]; };
#elif FILL
#include "common/list.glsl"
#endif

void main() {
    int tile = this_tile();
    begin_pixels();
#if AWAY
    ivec2 part = part_of(away_starts, tile);
#else
    ivec2 part = part_of(starts, tile);
#endif
#if FILL
    bool all_closed = true;
    for (int k = 0; k < PIXELS; ++k) all_closed = all_closed && best[k] == CLOSED;
    if (all_closed) pass_over(part);
#endif
#if AWAY
    take_nearest(away_listed, part, points_in_away_list());
#else
    take_nearest(listed, part, points_in_list());
#endif
    if (tile < 0) return;
#if FILL
    for (int k = 0; k < PIXELS; ++k)
        if (best[k] != CLOSED && shown[k] != NOTHING) {
            depths[index_of(k)] = floatBitsToUint(-linear_depth(best[k]));
            rows[index_of(k)] = shown[k];
            list[reserve(1u)] = uint(index_of(k));
        }
#else
    for (int k = 0; k < PIXELS; ++k)
        if (in_picture(k)) store_pixel(k);
#endif
#if FARTHEST
    uint most = 0u;
    for (int k = 0; k < PIXELS; ++k) {
        uint bits = depth_bits(k);
#if FARTHEST == 2
        bool is_shown = shown[k] != NOTHING;
        float depth = uintBitsToFloat(bits);
        float reach = epsilon * visible_radius(depth, is_shown ? shown[k] : 0u);
#if LOCAL
        reach = max(reach, LAYER_SLOPE * layer);
#endif
        precise float behind = depth + reach;
        bits = is_shown ? floatBitsToUint(behind) : bits;
#endif
        most = max(most, in_picture(k) ? bits : 0u);
    }
    atomicMax(farthest[tile], most);
#endif
}
