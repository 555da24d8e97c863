// Pixels without a sample show what those of the finest target around them give (Farooq 2013, 4.3.3). Depth-aware: only
// samples of one surface are blended, of the nearest that encloses the pixel, so that outlines do not grow (the limit of
// 4.4.4). UPSAMPLING 0 nearest, 1 bilinear, 2 bicubic. FRAMED: samples are on a grid, so that what the picture's frame
// cuts off is known to be surface; <source> says which are neighbours there.
#include "common/item.glsl"
#include "common/list.glsl"
#include "common/split.glsl"
#include <params>
#include "pyramidal/around.glsl"
#include "pyramidal/pixels.glsl"
#if FRAMED
#include <source>

layout(binding = TEXTURE_BEST) uniform usamplerBuffer best;  // of the targets' cells
#endif

layout(binding = TEXTURE_SHOWN) uniform usamplerBuffer shown;  // by the targets' samples
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed_cells;

const float SLANTED = 1.5;  // times as far apart samples of a grid may lie where a surface is seen aslant
const float AHEAD = 0.59;   // how far beside a pixel on an outline the nearest sample may lie, in sample spacings
const float NARROW = 2.0;   // width of a gap that is one between samples in any case, in spacings, or pixels if more
const int BETWEEN = 3;      // samples from one to the other of neighbours: a cell shows one of several
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
    if (near.x) extend(sides, vec2(mirrored.x, offset.y), NO_CELL);
    if (near.y) extend(sides, vec2(offset.x, mirrored.y), NO_CELL);
    if (all(near)) extend(sides, mirrored, NO_CELL);
}
#endif

// Blends what a surface shows around a pixel into it. Samples of a grid that lie farther apart than cells are blended as
// far as they lie apart.
void blend(int i, ivec2 pixel, int level, vec2 span) {
    Window window = window_of(level, pixel, UPSAMPLING == 2 ? 2 : 1);
    float wide = FRAMED != 0 ? max(spacing / cell_width(level, span.x), 1.0) : 1.0;
    float total = 0.0, depth = 0.0;
    Seen sum = UNSEEN;
    EACH_CELL(window, cell) {
        float here = depth_of(cell);
        if (here < span.x || here > span.y) continue;
        float weight = weight_of(offset_to(window, cell) / wide);
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

#if FRAMED
// The samples of a grid around a pixel, as far away as they may lie apart. farthest, apart: in cells.
Sides sides_around(ivec2 pixel, int level, float farthest, float apart) {
    Window window = window_of(level, pixel, 2);
    Sides sides = NO_SIDES;
    EACH_CELL(window, cell) {
        vec2 offset = offset_to(window, cell);
        if (isinf(depth_of(cell)) || dot(offset, offset) > farthest * farthest) continue;
        extend(sides, offset, cell);
        extend_beyond_frame(sides, offset, window, apart);
    }
    return sides;
}

// Whether the gap that a pixel lies in is one between samples of a grid, rather than between two parts of the subject:
// no wider than `narrow` cells, or with samples of one surface on either side that lie `between` apart in a range image.
bool is_between(Sides sides, float narrow, int between) {
    for (int k = 0; k < 4; ++k) {
        if (sides.low_nearest[k] + sides.high_nearest[k] <= narrow) return true;
        int low = sides.low_cell[k], high = sides.high_cell[k];
        if (low == NO_CELL || high == NO_CELL) continue;
        if (are_neighbors(texelFetch(best, low).r, texelFetch(best, high).r, between)) return true;
    }
    return false;
}
#endif

// What a target gives a pixel: the depths of the surface that encloses it; and between the outline of one surface and what
// was measured beside it behind, of the one that is nearer in the picture. x is +inf where there is none. closed: whether
// the pixel is in a hole or between samples, rather than in a bay of an outline.
struct Given {
    vec2 surface, beside;
    bool closed;
};

#define NO_SPAN vec2(uintBitsToFloat(NO_DEPTH))

Given given_by(ivec2 pixel, int level) {
    Given given = Given(NO_SPAN, NO_SPAN, false);
    Window window = window_of(level, pixel, 1);  // what encloses the pixel, however wide the kernel is
    bool gap = level <= density + 1;            // between samples, rather than a hole in what was measured
    bool hole = level > density && is_hole(window, level);
    if (!gap && !hole) return given;
    vec2 around = depths_around(window), span = vec2(0.0), nearest = span;
    if (isinf(around.x)) return given;
    float apart = spacing / cell_width(level, around.x), least = 1e9;  // samples, in cells
    float farthest = POLYGONS == 0 && !hole ? (FRAMED != 0 ? SLANTED : 1.0) * reach * max(apart, window.scale) : 1e9;
    bool bay = false;
    Sides all_around = NO_SIDES;
#if FRAMED
    if (gap) {
        all_around = sides_around(pixel, level, farthest, apart);
        float drawn = max(apart, window.scale);  // samples of coarser levels lie a pixel apart
        bool between = is_between(all_around, NARROW * drawn, int(ceil(float(BETWEEN) * drawn / apart)));
        bay = !between || !is_ahead(all_around, (margin + AHEAD) * apart);
    }
#endif
    for (int n = 0; n < SURFACES && isinf(given.surface.x); ++n) {
        span = surface_beyond(window, around, span.y, level);
        if (isinf(span.x)) break;
        Sides sides = NO_SIDES;
        EACH_CELL(window, cell) {
            float here = depth_of(cell);
            if (here < span.x || here > span.y) continue;
            vec2 offset = offset_to(window, cell);
            if (dot(offset, offset) > farthest * farthest) continue;
            extend(sides, offset, cell);
#if FRAMED
            if (gap) extend_beyond_frame(sides, offset, window, apart);
#endif
            extend(all_around, offset, cell);
            if (dot(offset, offset) < least) nearest = span;
            least = min(least, dot(offset, offset));
        }
        if (!encloses(sides, margin * spacing / cell_width(level, span.x))) continue;
#if FRAMED
        // A cell shows one sample.
        if (!gap && !is_ahead(sides, margin * apart + max(AHEAD * apart, 1.0))) continue;
#endif
        given.surface = span;
    }
#if POLYGONS || FRAMED
    if (gap && least < 1e9 && encloses(all_around, margin * apart)) given.beside = nearest;
#endif
    given.closed = !bay && !isinf(min(given.surface.x, given.beside.x));
    return given;
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
    // From the finest target that encloses it; if it is closed there or in a coarser one, which may not be shown.
    int from = 0, from_beside = 0;
    vec2 surface, beside;
    bool closed = false;
    for (int level = 1; level <= coarsest; ++level) {
        Given given = given_by(pixel, level);
        bool is_shown = (levels >> level & 1) != 0;
        closed = closed || given.closed;
        if (from == 0 && is_shown && !isinf(given.surface.x)) {
            from = level;
            surface = given.surface;
        }
        if (from_beside == 0 && is_shown && !isinf(given.beside.x)) {
            from_beside = level;
            beside = given.beside;
        }
        if (from == 0 && level > min(density, coarsest - 1)) {  // no gap between samples of one surface
            from = from_beside;
            surface = beside;
        }
        if (from == 0 || !closed) continue;
        blend(i, pixel, from, surface);
        return;
    }
    depths[i] = NO_DEPTH;
    rows[i] = NOTHING;
}
