// Samples of range views (viewer/gpu/range_samples.py): what each view is, where its samples lie in the
// buffers, and the way from a sample to a place and back.
//
// A sample of a level goes by (u, v): column and row, whole numbers. A pixel coordinate is one of level 0 with
// pixel centres at +0.5. Pod space is the camera space of the view's pod (right, up, back), screen view space
// that of the picture. Results are `precise`: whatever program computes them finds the same bits.

#include "common/split.glsl"


// What the views of a pose have, so that nothing is computed for what none has: RangeSamples.defines.
#ifndef RANGE_KINDS
#define RANGE_KINDS (RANGE_Z | RANGE_ALONG_RAY | RANGE_HEIGHT)
#define RANGE_LENS_STEPS 9
#define RANGE_HAS_XY 1
#define RANGE_WIDE 0
#endif

// RANGE_WIDE: a driver limits the number of texels, so a texel holds several samples: four; of x and y, two.
layout(binding = TEXTURE_RANGE_DEPTHS) uniform samplerBuffer range_depths;
#if RANGE_WIDE
layout(binding = TEXTURE_RANGE_LOOKS) uniform usamplerBuffer range_looks;
#else
layout(binding = TEXTURE_RANGE_LOOKS) uniform samplerBuffer range_looks;
#endif
layout(binding = TEXTURE_RANGE_XY) uniform samplerBuffer range_xy;
layout(binding = TEXTURE_RANGE_VIEWS) uniform usamplerBuffer range_views;

const int GRID_STEPS = 2;
#define NO_PLACE uintBitsToFloat(NO_DEPTH | 1u)  // NaN

struct RangeView {
    mat3x4 screen;       // rows: pod space to screen view space
    mat3x4 pod;          // and back
    vec2 focal, center;  // pixels; pixels per scan unit for heights
    vec4 bend, bend_more;  // k1 k2 p1 p2, k3 k4 k5 k6
    ivec2 size;
    int kind;            // RANGE_Z, ...
    bool distorted, has_xy, centered;  // centered: each coarse sample lies on a finer one
    uint first_id;       // of its first sample
    int entry;           // in the table
};

// One level of a view in the buffers.
struct RangeLevel {
    int first, first_tile;
    ivec2 size;
};

vec4 range_row(int texel) { return uintBitsToFloat(texelFetch(range_views, texel)); }

RangeView range_view(int number) {
    int at = number * RANGE_ENTRY;
    RangeView v;
    v.screen = mat3x4(range_row(at), range_row(at + 1), range_row(at + 2));
    v.pod = mat3x4(range_row(at + 3), range_row(at + 4), range_row(at + 5));
    vec4 pinhole = range_row(at + 6);
    v.focal = pinhole.xy;
    v.center = pinhole.zw;
    v.bend = range_row(at + 7);
    v.bend_more = range_row(at + 8);
    uvec4 form = texelFetch(range_views, at + 9), more = texelFetch(range_views, at + 10);
    v.size = ivec2(form.xy);
    v.kind = int(form.z);
    v.first_id = form.w;
    v.distorted = more.x != 0u;
    v.has_xy = more.y != 0u;
    v.centered = more.z != 0u;
    v.entry = at;
    return v;
}

RangeLevel range_level(RangeView v, int level) {
    uvec4 found = texelFetch(range_views, v.entry + RANGE_LEVELS_AT + level);
    return RangeLevel(int(found.x), int(found.y), ivec2(found.zw));
}

int sample_index(RangeLevel level, ivec2 uv) { return level.first + uv.y * level.size.x + uv.x; }

int sample_index(RangeView v, int level, ivec2 uv) { return sample_index(range_level(v, level), uv); }

// The number that rows go by; all samples count, there or not.
uint sample_id(RangeView v, ivec2 uv) { return v.first_id + uint(uv.y * v.size.x + uv.x); }

// The view, 0, u and v of such a number.
ivec4 sample_of_id(uint id, int view_count) {
    int low = 0, high = view_count - 1;
    while (low < high) {
        int middle = (low + high + 1) / 2;
        bool after = texelFetch(range_views, middle * RANGE_ENTRY + 9).w > id;
        low = after ? low : middle;
        high = after ? middle - 1 : high;
    }
    uvec4 form = texelFetch(range_views, low * RANGE_ENTRY + 9);
    uint within = id - form.w;
    return ivec4(low, 0, split(int(within), int(form.x)));
}

// The view, level, u and v of a place in the buffers.
ivec4 sample_at(int index, int view_count) {
    int low = 0, high = view_count * RANGE_MOST_LEVELS - 1;
    while (low < high) {
        int middle = (low + high + 1) / 2;
        int level = middle % RANGE_MOST_LEVELS;
        int entry = middle / RANGE_MOST_LEVELS * RANGE_ENTRY + RANGE_LEVELS_AT + level;
        bool after = int(texelFetch(range_views, entry).x) > index;
        low = after ? low : middle;
        high = after ? middle - 1 : high;
    }
    ivec4 found = ivec4(low / RANGE_MOST_LEVELS, low % RANGE_MOST_LEVELS, 0, 0);
    uvec4 level = texelFetch(range_views, found.x * RANGE_ENTRY + RANGE_LEVELS_AT + found.y);
    int within = index - int(level.x);
    found.zw = split(within, int(level.z));
    return found;
}

#if RANGE_WIDE
float sample_depth(int index) { return texelFetch(range_depths, index >> 2)[index & 3]; }

vec2 sample_xy(int index) {
    vec4 two = texelFetch(range_xy, index >> 1);
    return (index & 1) == 0 ? two.xy : two.zw;
}

// Colour (sRGB) and alpha; 0: no sample.
vec4 sample_look(int index) {
    uint word = texelFetch(range_looks, index >> 2)[index & 3];
    return vec4(uvec4(word) >> uvec4(0, 8, 16, 24) & 0xFFu) * (1.0 / 255.0);
}
#else
float sample_depth(int index) { return texelFetch(range_depths, index).r; }

vec2 sample_xy(int index) { return texelFetch(range_xy, index).xy; }

// Colour (sRGB) and alpha; 0: no sample.
vec4 sample_look(int index) { return texelFetch(range_looks, index); }
#endif

// Whether there is a sample, of which more than such a part is known.
bool is_sample(int index, float least) { return sample_look(index).a > least; }

bool is_sample(int index) { return is_sample(index, 0.0); }

// Where samples of a level lie: pixel coordinates of (u, v). A coarse sample is in the middle of the finer
// ones that it is made of, or of as many as there would be if the image went on.
vec2 level_to_pixel(RangeView v, int level, vec2 uv) {
    float stride = float(1 << level);
    return uv * stride + (v.centered ? 0.5 : 0.5 * stride);
}

// (u, v) of a level, whole where a sample lies.
vec2 pixel_to_level(RangeView v, int level, vec2 pixel) {
    float stride = float(1 << level);
    return (pixel - (v.centered ? 0.5 : 0.5 * stride)) / stride;
}

// How far samples of a level lie apart across the line of sight, in scan units.
float sample_spacing(RangeView v, int level, float depth) {
    float spacing = float(1 << level) / min(v.focal.x, v.focal.y);
    return v.kind == RANGE_HEIGHT ? spacing : spacing * depth;
}

// Whether neighbours in a level with these depths are of one surface.
bool same_surface(RangeView v, int level, float depth, float other) {  // not where one is infinite
    return abs(depth - other) <= STEEPEST * sample_spacing(v, level, min(depth, other));
}

#if RANGE_LENS_STEPS
// Where a lens shows an ideal direction (right / forwards, down / forwards): OpenCV's model. And its derivatives by
// right; right or down (they are the same); down.
vec2 distorted(RangeView v, vec2 ideal, out vec3 jacobian) {
    precise float r = ideal.x * ideal.x + ideal.y * ideal.y, cross_term = 2.0 * ideal.x * ideal.y;
    precise float above = 1.0 + r * (v.bend.x + r * (v.bend.y + r * v.bend_more.x));
    precise float below = 1.0 + r * (v.bend_more.y + r * (v.bend_more.z + r * v.bend_more.w));
    precise float above_change = v.bend.x + r * (2.0 * v.bend.y + 3.0 * r * v.bend_more.x);
    precise float below_change = v.bend_more.y + r * (2.0 * v.bend_more.z + 3.0 * r * v.bend_more.w);
    precise float radial = above / below;
    precise float change = (above_change - radial * below_change) / below;
    precise vec2 bent = radial * ideal + v.bend.zw * cross_term + v.bend.wz * (r + 2.0 * ideal * ideal);
    precise vec2 straight = radial + 2.0 * change * ideal * ideal;
    straight += 2.0 * v.bend.zw * ideal.yx + 6.0 * v.bend.wz * ideal;
    precise float across = change * cross_term + 2.0 * (v.bend.z * ideal.x + v.bend.w * ideal.y);
    jacobian = vec3(straight.x, across, straight.y);
    return bent;
}

// The other way, by as many of Newton's steps as the lenses take.
vec2 undistorted(RangeView v, vec2 seen) {
    precise vec2 ideal = seen;
    for (int i = 0; i < RANGE_LENS_STEPS; ++i) {
        vec3 j;
        precise vec2 missed = seen - distorted(v, ideal, j);
        precise vec2 moved = vec2(j.z * missed.x - j.y * missed.y, j.x * missed.y - j.y * missed.x);
        ideal += moved / (j.x * j.z - j.y * j.y);
    }
    return ideal;
}
#endif

// Right and up per unit of depth of a pixel coordinate; for heights, in scan units.
vec2 pixel_ray(RangeView v, vec2 pixel) {
    precise vec2 seen = (pixel - v.center) / v.focal;
#if RANGE_LENS_STEPS
    if (v.distorted) seen = undistorted(v, seen);
#endif
    return vec2(seen.x, -seen.y);
}

vec3 pixel_place(RangeView v, vec2 pixel, float depth) {
    vec2 ray = pixel_ray(v, pixel);
#if (RANGE_KINDS & RANGE_HEIGHT) != 0
    if (v.kind == RANGE_HEIGHT) return vec3(ray, -depth);
#endif
    precise float forwards = depth;
#if (RANGE_KINDS & RANGE_ALONG_RAY) != 0
    precise float longer = sqrt(1.0 + ray.x * ray.x + ray.y * ray.y);
    if (v.kind == RANGE_ALONG_RAY) forwards = depth / longer;
#endif
    precise vec2 aside = ray * forwards;
    return vec3(aside, -forwards);
}

// The place in pod space of (u, v) of a level at a depth of the view's kind. With measured x and y (has_xy)
// these are the sample's that is nearest to (u, v).
vec3 sample_place(RangeView v, RangeLevel found, int level, vec2 uv, float depth) {
#if RANGE_HAS_XY
    if (v.has_xy) {
        ivec2 nearest = clamp(ivec2(floor(uv + 0.5)), ivec2(0), found.size - 1);
        return vec3(sample_xy(sample_index(found, nearest)), -depth);
    }
#endif
    return pixel_place(v, level_to_pixel(v, level, uv), depth);
}

vec3 sample_place(RangeView v, int level, vec2 uv, float depth) {
    return sample_place(v, range_level(v, level), level, uv, depth);
}

// Place in pod space and depth of a sample; the depth is infinite where none is.
vec4 placed_sample(RangeView v, RangeLevel found, int level, ivec2 uv) {
    bool inside = all(greaterThanEqual(uv, ivec2(0))) && all(lessThan(uv, found.size));
    int index = sample_index(found, inside ? uv : ivec2(0));
    float depth = sample_depth(index);
    return vec4(sample_place(v, found, level, vec2(uv), depth), inside && is_sample(index) ? depth : uintBitsToFloat(NO_DEPTH));
}

vec3 transformed(mat3x4 rows, vec3 place) {
    precise vec3 moved = vec3(rows[0].x, rows[1].x, rows[2].x) * place.x;
    moved = moved + vec3(rows[0].y, rows[1].y, rows[2].y) * place.y;
    moved = moved + vec3(rows[0].z, rows[1].z, rows[2].z) * place.z;
    moved = moved + vec3(rows[0].w, rows[1].w, rows[2].w);
    return moved;
}

vec3 turned(mat3x4 rows, vec3 direction) {
    precise vec3 out_direction = vec3(rows[0].x, rows[1].x, rows[2].x) * direction.x;
    out_direction = out_direction + vec3(rows[0].y, rows[1].y, rows[2].y) * direction.y;
    out_direction = out_direction + vec3(rows[0].z, rows[1].z, rows[2].z) * direction.z;
    return out_direction;
}

vec3 to_screen_view(RangeView v, vec3 place) { return transformed(v.screen, place); }

vec3 to_pod(RangeView v, vec3 screen_view_place) { return transformed(v.pod, screen_view_place); }

#if RANGE_HAS_XY
// The sample that a pixel coordinate is in, -1 where none is.
int sample_under(RangeLevel level, vec2 pixel) {
    bool inside = all(greaterThanEqual(pixel, vec2(0.0))) && all(lessThan(pixel, vec2(level.size)));
    int index = sample_index(level, inside ? ivec2(pixel) : ivec2(0));
    return inside && is_sample(index) ? index : -1;
}

// The pixel coordinate at which the measured grid has this x and y, from a first guess, by Gauss and Newton; NaN where
// no sample is on the way there.
vec2 on_grid(RangeView v, vec2 xy, vec2 guess) {
    RangeLevel level = range_level(v, 0);
    precise vec2 pixel = guess;
    for (int i = 0; i < GRID_STEPS; ++i) {
        int index = sample_under(level, pixel);
        if (index < 0) return vec2(NO_PLACE);
        // What a pixel to the right and one down change: between neighbours that are there.
        vec2 middle = floor(pixel) + 0.5;
        int left = sample_under(level, middle - vec2(1, 0)), right = sample_under(level, middle + vec2(1, 0));
        int above = sample_under(level, middle - vec2(0, 1)), below = sample_under(level, middle + vec2(0, 1));
        vec2 apart = vec2(ivec2(left >= 0, above >= 0) + ivec2(right >= 0, below >= 0));
        if (min(apart.x, apart.y) == 0.0) return vec2(NO_PLACE);
        precise vec2 along = sample_xy(right < 0 ? index : right);
        precise vec2 down = sample_xy(below < 0 ? index : below);
        along = (along - sample_xy(left < 0 ? index : left)) / apart.x;
        down = (down - sample_xy(above < 0 ? index : above)) / apart.y;
        precise vec2 missed = xy - sample_xy(index);
        precise float area = along.x * down.y - along.y * down.x;
        if (area == 0.0) return vec2(NO_PLACE);
        precise vec2 moved = vec2(missed.x * down.y - missed.y * down.x, along.x * missed.y - along.y * missed.x);
        pixel = middle + moved / area;
    }
    return sample_under(level, pixel) < 0 ? vec2(NO_PLACE) : pixel;
}
#endif

// The pixel coordinate and the depth, of the view's kind, of a place in screen view space: what sample_place
// and to_screen_view undo. NaN where the pod does not see: behind it, where its lens shows nothing, and where
// no sample of a measured grid is near.
vec3 project_to(RangeView v, vec3 screen_view_place) {
    vec3 place = to_pod(v, screen_view_place);
    precise float depth = -place.z;
    precise vec2 seen = vec2(place.x, -place.y);
    if (v.kind != RANGE_HEIGHT) {
        if (!(depth > 0.0)) return vec3(NO_PLACE);
        seen = seen / depth;
#if RANGE_LENS_STEPS
        if (v.distorted) {
            vec3 j;
            seen = distorted(v, seen, j);
            if (!(j.x + j.z > 0.0 && j.x * j.z > j.y * j.y)) return vec3(NO_PLACE);  // folded over
        }
#endif
        precise float far = sqrt(place.x * place.x + place.y * place.y + place.z * place.z);
        depth = v.kind == RANGE_ALONG_RAY ? far : depth;
    }
    precise vec2 pixel = seen * v.focal + v.center;
#if RANGE_HAS_XY
    if (v.has_xy) pixel = on_grid(v, place.xy, pixel);
#endif
    return vec3(pixel, depth);
}

// The normal of the plane through the middle one of 3 x 3 samples, as placed_sample gives them, and those of its
// surface: in pod space, towards the pod, of unit length; zero where they span no plane.
vec3 fitted_normal(RangeView v, int level, vec4 around[9]) {
    // Sums over offsets (1, u, v, uu, uv, vv), and of these times the places relative to the sample's.
    precise vec3 count = vec3(1.0, 0.0, 0.0), squares = vec3(0.0);
    precise vec3 places = vec3(0.0), places_u = vec3(0.0), places_v = vec3(0.0);
    for (int i = 0; i < 9; ++i) {
        if (i == 4 || !same_surface(v, level, around[4].w, around[i].w)) continue;
        int x = i % 3 - 1, y = i / 3 - 1;
        precise vec3 away = around[i].xyz - around[4].xyz;
        count += vec3(1, x, y);
        squares += vec3(x * x, x * y, y * y);
        places += away;
        places_u += float(x) * away;
        places_v += float(y) * away;
    }
    squares = count.x * squares - vec3(count.y * count.y, count.y * count.z, count.z * count.z);
    if (squares.x * squares.z == squares.y * squares.y) return vec3(0.0);
    places_u = count.x * places_u - count.y * places;
    places_v = count.x * places_v - count.z * places;
    precise vec3 right = squares.z * places_u - squares.y * places_v;
    precise vec3 down = squares.x * places_v - squares.y * places_u;
    precise vec3 normal = cross(down, right);
    precise float squared = dot(normal, normal);
    if (!(squared > 0.0)) return vec3(0.0);
    precise float away = v.kind == RANGE_HEIGHT ? -normal.z : dot(normal, around[4].xyz);
    return normal * (away > 0.0 ? -1.0 : 1.0) / sqrt(squared);
}

// The same of a sample of a level, in screen view space.
vec3 sample_normal(RangeView v, int level, ivec2 uv) {
    RangeLevel found = range_level(v, level);
    vec4 around[9];
    for (int i = 0; i < 9; ++i) around[i] = placed_sample(v, found, level, uv + ivec2(i % 3, i / 3) - 1);
    return turned(v.screen, fitted_normal(v, level, around));
}
