// Lists the tiles of range views that a picture needs: of the level whose samples fit its pixels, in the picture, and
// not facing away. Each is listed once, and an invocation draws a row of its samples; those whose quads are larger than
// LARGE pixels are listed for each of `parts` of the picture's rows, so that no invocation has much to draw.
// CULL_BACK: tiles that face away are left out. SKIP: what the picture does not show is left out.
#include "common/item.glsl"
#include "common/list.glsl"
#include <params>
#include "range/tiles.glsl"

layout(std430, binding = STORAGE_TILE_COUNTS) buffer Counts { uint counts[]; };  // as viewer/projection/views.py names them; then those drawn of each view

uniform int capacity;  // of the list

const float LARGE = 16.0;

// Pixels between neighbouring samples of a tile, where these face the pod: the most, since a tile may hold a silhouette
// before what is far behind.
float pixels_apart(RangeView v, int level, RangeTile tile) {
    float most = 0.0;
    for (int i = 0; i < 8; ++i) {
        vec3 pod = tile_corner(v, tile, i);
        float depth = max(-to_screen_view(v, pod).z, view_near);
        most = max(most, sample_spacing(v, level, -pod.z) * scale_at(depth));
    }
    return most;
}

// Whether samples of a tile lie farther apart than the picture shows, so that a finer level is drawn in its stead.
bool is_coarse(RangeView v, int level, ivec2 tile) {
    if (level <= first_level) return false;
#if LOD
    RangeLevel found = range_level(v, level);
    int columns = (found.size.x + RANGE_TILE - 1) / RANGE_TILE;
    RangeTile bounds = range_tile(found.first_tile + tile.y * columns + tile.x);
    return is_empty(bounds) || pixels_apart(v, level, bounds) > detail;
#else
    return true;
#endif
}

void main() {
    uint i = item();
    if (i >= item_count) return;
    ivec2 at = level_of_tile(int(i), RANGE_COUNT);
    RangeView v = range_view(at.x);
    RangeLevel found = range_level(v, at.y);
    int within = int(i) - found.first_tile;
    ivec2 tiles = (found.size + RANGE_TILE - 1) / RANGE_TILE;
    if (at.y < first_level || at.y > last_level || within >= tiles.x * tiles.y) return;
    ivec2 tile = ivec2(within % tiles.x, within / tiles.x);
    if (is_coarse(v, at.y, tile)) return;
    for (int level = at.y + 1; level <= last_level; ++level)
        if (!is_coarse(v, level, tile >> (level - at.y))) return;  // that one is drawn
    RangeTile bounds = range_tile(int(i));
    uint cause = is_empty(bounds) ? TILES_EMPTY : TILES_DRAWN;
#if SKIP
    if (cause == TILES_DRAWN && is_outside(v, bounds, 1.0)) cause = TILES_OUTSIDE;
#if CULL_BACK
    if (cause == TILES_DRAWN && faces_away(v, bounds)) cause = TILES_AWAY;
#endif
#endif
    atomicAdd(counts[cause], 1u);
    if (cause != TILES_DRAWN) return;
    atomicAdd(counts[TILES_CAUSES + uint(at.x)], 1u);
    int count = POLYGONS != 0 && pixels_apart(v, at.y, bounds) > LARGE ? parts : 1;
    for (int part = 0; part < count; ++part) {
        uint place = reserve(uint(RANGE_TILE)) / uint(RANGE_TILE);
        if (place < uint(capacity)) list[place] = i | uint(count > 1 ? part + 1 : 0) << 24;
    }
}
