// Samples that are seen through the holes of a nearer surface are taken away: where, in the target whose cells the
// samples of that surface all fill, it encloses the pixel, and no sample of it is a neighbour (Farooq 2013, 6.3.2).
// <source> says what a sample is.
#include "common/item.glsl"
#include "common/split.glsl"
#include <params>
#include "pyramidal/around.glsl"

#include "common/color.glsl"
#include "pyramidal/seen.glsl"
#include <source>

layout(binding = TEXTURE_BEST) uniform usamplerBuffer best;  // of the targets' cells
layout(std430, binding = STORAGE_DEPTHS) buffer Depths { uint depths[]; };
layout(std430, binding = STORAGE_ROWS) buffer Rows { uint rows[]; };

const int ON_GRID = POLYGONS + FRAMED;  // points that lie anywhere leave some cells of their level empty

// Whether a nearer surface encloses a pixel in the target of a level. dense: whose cells samples
// fill, of which `tolerance` counts.
bool is_hidden(int i, float depth, int level, int dense) {
    Window window = window_of(level, split(i, view_size.x), 1);
    vec2 around = depths_around(window);
    if (around.x + tolerance * cell_width(dense, around.x) >= depth) return false;
    vec2 span = surface_beyond(window, around, 0.0, level);
    if (span.y + tolerance * cell_width(dense, span.x) >= depth) return false;
    Sides sides = NO_SIDES;
    EACH_CELL(window, cell) {
        if (depth_of(cell) > span.y) continue;
        extend(sides, offset_to(window, cell), cell);
        if (are_neighbors(texelFetch(best, cell).r, rows[i], neighbors)) return false;
    }
    return encloses(sides, 0.0);
}

void main() {
    int i = int(item());
    if (i >= view_size.x * view_size.y || rows[i] == NOTHING) return;
    float depth = uintBitsToFloat(depths[i]);
    int dense = clamp(int(ceil(log2(max(spacing * scale_at(depth), 1.0)))), 0, coarsest);
    for (int level = max(dense, 1); level <= min(dense + 1 - ON_GRID, coarsest); ++level) {
        if (!is_hidden(i, depth, level, dense)) continue;
        depths[i] = NO_DEPTH;
        rows[i] = NOTHING;
        return;
    }
}
