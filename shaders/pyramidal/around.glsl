// What is around a pixel in a target, and which of it is one surface. step is the largest depth step of a surface, in
// cells.
#include "common/view.glsl"
#include "pyramidal/targets.glsl"

layout(binding = TEXTURE_KEYS) uniform usamplerBuffer keys;   // of the targets' cells: float bits of depths
layout(binding = TEXTURE_SPOTS) uniform samplerBuffer spots;  // where their samples lie, in pixels

const int SURFACES = 3;  // sheets behind one another that are told apart
const int CHAIN = 3;     // times that a surface is followed from one sample to the next

// The cells around a pixel.
struct Window {
    ivec2 low, high;  // cells from, and to
    int start, width; // of the target
    vec2 pixel;       // in cells
    float scale;
};

// reach: how many cells to each side.
Window window_of(int level, ivec2 pixel, int reach) {
    ivec2 size = target_size(view_size, level), cell = pixel >> level;
    float scale = 1.0 / float(1 << level);
    int start = target_start(view_size, level);
    vec2 place = (vec2(pixel) + 0.5) * scale;
    return Window(max(cell - reach, 0), min(cell + reach, size - 1), start, size.x, place, scale);
}

// Width of a cell of a level, scan units.
float cell_width(int level, float depth) { return float(1 << level) / scale_at(depth); }

// The depth of a cell's sample, +inf: none.
float depth_of(int cell) { return uintBitsToFloat(texelFetch(keys, cell).r); }

// From the pixel to a cell's sample, in cells.
vec2 offset_to(Window window, int cell) { return texelFetch(spots, cell).xy * window.scale - window.pixel; }

#define EACH_CELL(window, cell) \
    for (int y_ = window.low.y; y_ <= window.high.y; ++y_) \
        for (int cell = window.start + y_ * window.width + window.low.x, \
                 end_ = cell + window.high.x - window.low.x; cell <= end_; ++cell)

// The least and the largest depth around; +inf where nothing is.
vec2 depths_around(Window window) {
    vec2 span = vec2(uintBitsToFloat(NO_DEPTH), 0.0);
    EACH_CELL(window, cell) {
        float depth = depth_of(cell);
        span.x = min(span.x, depth);
        if (!isinf(depth)) span.y = max(span.y, depth);
    }
    return span;
}

// The next surface beyond a depth: depths from x to y, connected by steps no larger than that of neighbours; x is +inf
// where there is none. around: all that is there.
vec2 surface_beyond(Window window, vec2 around, float depth, int level) {
    vec2 span = vec2(uintBitsToFloat(NO_DEPTH));
    if (depth < around.x) span.x = around.x;
    else
        EACH_CELL(window, cell) {
            float here = depth_of(cell);
            if (here > depth) span.x = min(span.x, here);
        }
    if (isinf(span.x)) return span;
    float reach = step * cell_width(level, span.x);
    if (around.y <= span.x + reach) return vec2(span.x, around.y);
    span.y = span.x;
    for (int n = 0; n < CHAIN; ++n) {
        float last = span.y + reach;
        EACH_CELL(window, cell) {
            float here = depth_of(cell);
            if (here <= last) span.y = max(span.y, here);
        }
    }
    return span;
}

// How far samples lie to each of eight sides of a pixel; how much farther to that side than beside it; and of the nearest
// that is ahead, within a right angle, its distance and cell.
struct Sides {
    vec4 low, high;
    vec4 low_ahead, high_ahead;
    vec4 low_nearest, high_nearest;
    ivec4 low_cell, high_cell;
};

const int NO_CELL = -1;  // of what no cell shows
const Sides NO_SIDES =
    Sides(vec4(1e9), vec4(-1e9), vec4(1e9), vec4(-1e9), vec4(1e9), vec4(1e9), ivec4(NO_CELL), ivec4(NO_CELL));

void extend(inout Sides sides, vec2 offset, int cell) {
    vec4 along = vec4(offset, sqrt(0.5) * vec2(offset.x + offset.y, offset.x - offset.y)), beside = abs(along.yxwz);
    sides.low = min(sides.low, along);
    sides.high = max(sides.high, along);
    sides.low_ahead = min(sides.low_ahead, along + beside);
    sides.high_ahead = max(sides.high_ahead, along - beside);
    float away = length(offset);
    for (int k = 0; k < 4; ++k) {
        if (along[k] + beside[k] <= 0.0 && away < sides.low_nearest[k]) {
            sides.low_nearest[k] = away;
            sides.low_cell[k] = cell;
        }
        if (along[k] - beside[k] >= 0.0 && away < sides.high_nearest[k]) {
            sides.high_nearest[k] = away;
            sides.high_cell[k] = cell;
        }
    }
}

// Whether they lie on all sides. outside: how far the pixel may be beside them, in cells.
bool encloses(Sides sides, float outside) {
    return all(lessThanEqual(sides.low, vec4(outside))) && all(greaterThanEqual(sides.high, vec4(-outside)));
}

// Whether they lie ahead, within a right angle, on all sides. outside: as above.
bool is_ahead(Sides sides, float outside) {
    return all(lessThanEqual(sides.low_ahead, vec4(outside))) && all(greaterThanEqual(sides.high_ahead, vec4(-outside)));
}
