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

void main() {
    int i = int(item());
    if (i >= view_size.x * view_size.y || rows[i] == NOTHING) return;
    float depth = uintBitsToFloat(depths[i]);
    float apart = spacing * scale_at(depth);
    int level = clamp(int(ceil(log2(max(apart, 1.0)))), 0, coarsest);
    if (level == 0) return;
    Window window = window_of(level, split(i, view_size.x), 1);
    vec2 around = depths_around(window);
    if (around.x + tolerance * cell_width(level, around.x) >= depth) return;
    vec2 span = surface_beyond(window, around, 0.0, level);
    if (span.y + tolerance * cell_width(level, span.x) >= depth) return;
    Sides sides = NO_SIDES;
    bool connected = false;
    EACH_CELL(window, cell) {
        if (depth_of(cell) > span.y) continue;
        extend(sides, offset_to(window, cell));
        connected = connected || are_neighbors(texelFetch(best, cell).r, rows[i]);
    }
    if (connected || !encloses(sides, 0.0)) return;
    depths[i] = NO_DEPTH;
    rows[i] = NOTHING;
}
