// Pixels without a sample show what those of the finest target around them give (Farooq 2013, 4.3.3). Depth-aware: only
// samples of one surface are blended, of the nearest that encloses the pixel, so that outlines do not grow (the limit of
// 4.4.4). UPSAMPLING 0 nearest, 1 bilinear, 2 bicubic. FRAMED: samples are on a grid, so that what the picture's frame
// cuts off is known to be surface.
#include "common/item.glsl"
#include "common/list.glsl"
#include "common/split.glsl"
#include <params>
#include "pyramidal/around.glsl"
#include "pyramidal/pixels.glsl"

layout(binding = TEXTURE_SHOWN) uniform usamplerBuffer shown;  // by the targets' samples
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed_cells;

const float SLANTED = 1.5;  // times as far apart samples of a grid may lie where a surface is seen aslant
const float AHEAD = 0.65;   // how far beside a pixel on an outline the nearest sample may lie, in sample spacings
const float LEAST = 1e-3;  // weight of samples beyond a kernel's reach, before distance

float kernel(float x) {
    x = abs(x);
#if UPSAMPLING == 2
    return x < 1.0 ? 2.0 / 3.0 - x * x * (1.0 - 0.5 * x) : x < 2.0 ? pow(2.0 - x, 3.0) / 6.0 : 0.0;
#else
    return max(1.0 - x, 0.0);
#endif
}

// Weight of a sample at an offset from the pixel, in cells.
float weight_of(vec2 offset) {
#if UPSAMPLING == 0
    return 1.0 / (1e-6 + dot(offset, offset));
#else
    return kernel(offset.x) * kernel(offset.y) + LEAST / (1.0 + dot(offset, offset));
#endif
}

// Whether what is empty around a pixel is no larger than `widest` cells are wide: a hole, and no gap between outlines. At
// the picture's edges, of which less is known, a hole is smaller by as much.
bool is_hole(Window window, int level) {
    int below = level - density, filled = 0;
    EACH_CELL(window, cell) filled += int(count_filled(texelFetch(shown, cell)));
    ivec2 end = min(window.high + 1 << below, target_size(view_size, density));
    ivec2 cells = end - (window.low << below);
    int known = cells.x * cells.y;
    return float(known - filled) <= widest * widest * float(known) / 9.0;
}

#if FRAMED
// What the picture's frame cuts off goes on beyond it as its mirror image. apart: samples, in cells.
void extend_beyond_frame(inout Sides sides, vec2 offset, Window window, float apart) {
    vec2 before = window.pixel, after = vec2(view_size) * window.scale - window.pixel;
    vec2 frame = vec2(before.x < after.x ? -before.x : after.x, before.y < after.y ? -before.y : after.y);
    vec2 mirrored = 2.0 * frame - offset;
    bvec2 near = lessThan(abs(frame), vec2(apart));
    if (near.x) extend(sides, vec2(mirrored.x, offset.y));
    if (near.y) extend(sides, vec2(offset.x, mirrored.y));
    if (all(near)) extend(sides, mirrored);
}
#endif

// Blends what a surface shows around a pixel into it.
void blend(int i, ivec2 pixel, int level, vec2 span) {
    Window window = window_of(level, pixel, UPSAMPLING == 2 ? 2 : 1);
    float total = 0.0, depth = 0.0;
    Seen sum = UNSEEN;
    EACH_CELL(window, cell) {
        float here = depth_of(cell);
        if (here < span.x || here > span.y) continue;
        float weight = weight_of(offset_to(window, cell));
        Seen one = unpack_seen(texelFetch(shown, cell));
#if UPSAMPLING == 0
        if (weight <= total) continue;
        total = weight;
        depth = here;
        sum = one;
#else
        total += weight;
        depth += weight * here;
        sum.color += weight * one.color;
        sum.normal += weight * one.normal;
        sum.value += weight * one.value;
#endif
    }
#if UPSAMPLING != 0
    depth /= total;
    sum.color /= total;
    sum.value /= total;
#endif
    store(i, depth, NOTHING, level, sum);
}

// Fills a pixel from a target; whether it could.
bool fill(int i, ivec2 pixel, int level) {
    Window window = window_of(level, pixel, 1);  // what encloses the pixel, however wide the kernel is
    bool gap = level <= density + 1;            // between samples, rather than a hole in what was measured
    bool hole = level > density && is_hole(window, level);
    if (!gap && !hole) return false;
    vec2 around = depths_around(window), span = vec2(0.0), nearest = span;
    if (isinf(around.x)) return false;
    float apart = spacing / cell_width(level, around.x), least = 1e9;  // samples, in cells
    float farthest = POLYGONS == 0 && !hole ? (FRAMED != 0 ? SLANTED : 1.0) * reach * max(apart, window.scale) : 1e9;
    Sides all_around = NO_SIDES;
#if FRAMED
    EACH_CELL(window, cell) {
        vec2 offset = offset_to(window, cell);
        if (isinf(depth_of(cell)) || dot(offset, offset) > farthest * farthest) continue;
        extend(all_around, offset);
        if (gap) extend_beyond_frame(all_around, offset, window, apart);
    }
    float ahead = margin * apart + (gap ? AHEAD * apart : max(AHEAD * apart, 1.0));  // a cell shows one sample
    if (!is_ahead(all_around, ahead)) return false;
#endif
    for (int n = 0; n < SURFACES; ++n) {
        span = surface_beyond(window, around, span.y, level);
        if (isinf(span.x)) break;
        Sides sides = NO_SIDES;
        EACH_CELL(window, cell) {
            float here = depth_of(cell);
            if (here < span.x || here > span.y) continue;
            vec2 offset = offset_to(window, cell);
            if (dot(offset, offset) > farthest * farthest) continue;
            extend(sides, offset);
#if FRAMED
            if (gap) extend_beyond_frame(sides, offset, window, apart);
#endif
            extend(all_around, offset);
            if (dot(offset, offset) < least) nearest = span;
            least = min(least, dot(offset, offset));
        }
        if (!encloses(sides, margin * spacing / cell_width(level, span.x))) continue;
#if FRAMED
        if (!gap && !is_ahead(sides, ahead)) continue;
#endif
        blend(i, pixel, level, span);
        return true;
    }
#if POLYGONS || FRAMED
    // Between the outline of one surface and what was measured beside it behind: the one that is nearer in the picture.
    if (gap && encloses(all_around, margin * apart)) {
        blend(i, pixel, level, nearest);
        return true;
    }
#endif
    return false;
}

void main() {
    uint n = item();
    if (n >= list_count) return;
    int edge = 1 << coarsest, columns = target_size(view_size, coarsest).x;
    int cell = int(texelFetch(listed_cells, int(n) >> 2 * coarsest).r), within = int(n) & edge * edge - 1;
    ivec2 pixel = edge * split(cell, columns) + ivec2(within & edge - 1, within >> coarsest);
    if (any(greaterThanEqual(pixel, view_size))) return;
    int i = pixel.y * view_size.x + pixel.x;
    if (rows[i] != NOTHING && (levels & 1) != 0) return;
    for (int level = 1; level <= coarsest; ++level)
        if ((levels >> level & 1) != 0 && fill(i, pixel, level)) return;
    depths[i] = NO_DEPTH;
    rows[i] = NOTHING;
}
