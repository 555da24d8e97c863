// A level of a range view from the next finer one. Depths, colours and measured places are means over samples
// of one surface, the nearest in reach, weighted by taps and alphas; NEAREST: those of the nearest sample, the first
// in the order of rows. Alpha is the mean of those in reach, there or not.
#include "common/item.glsl"
#include "common/color.glsl"
#include "range/samples.glsl"

// A part of the level that is written.
layout(std430, binding = STORAGE_RANGE_DEPTHS) writeonly buffer Depths { float out_depths[]; };
layout(std430, binding = STORAGE_RANGE_LOOKS) writeonly buffer Looks { uint out_looks[]; };
#if RANGE_HAS_XY
layout(std430, binding = STORAGE_RANGE_XY) writeonly buffer Xy { vec2 out_xy[]; };
#endif

uniform int number;  // of the view
uniform int level;   // that is read
uniform int run;     // samples of a row that an invocation makes
uniform uint first;  // run that is made by this call
uniform int page;    // the first sample of those that are bound

const float taps[] = TAPS;
const int REACH = COUNT * COUNT;

void reduce(RangeView view, RangeLevel fine, ivec2 at, int i) {
    ivec2 begin = 2 * at + FIRST;
    float depths[REACH], weights[REACH];  // of what is in reach; 0: not there
    vec3 colors[REACH];
    int indices[REACH];
    float nearest = uintBitsToFloat(NO_DEPTH), present = 0.0, inside = 0.0;
    vec3 color = vec3(0.0);
    int chosen = 0;
    for (int k = 0; k < REACH; ++k) {
        ivec2 uv = begin + ivec2(k % COUNT, k / COUNT);
        bool within = all(greaterThanEqual(uv, ivec2(0))) && all(lessThan(uv, fine.size));
        indices[k] = sample_index(fine, within ? uv : ivec2(0));
        vec4 look = sample_look(indices[k]);
        float tap = within ? taps[k % COUNT] * taps[k / COUNT] : 0.0;
        depths[k] = sample_depth(indices[k]);
        weights[k] = tap * round(255.0 * look.a);
        colors[k] = look.rgb;
        inside += tap;
        present += weights[k];
        bool nearer = weights[k] > 0.0 && depths[k] < nearest;
        nearest = nearer ? depths[k] : nearest;
        chosen = nearer ? indices[k] : chosen;
        color = nearer ? look.rgb : color;
    }
    if (present == 0.0) {
        out_depths[i] = 0.0;
        out_looks[i] = 0u;
#if RANGE_HAS_XY
        out_xy[i] = vec2(0.0);
#endif
        return;
    }
    float depth = nearest;
#if RANGE_HAS_XY
    vec2 place = sample_xy(chosen);
#endif
#if !NEAREST
    // Relative to the nearest, so that what is the same everywhere stays the same.
    precise float weight = 0.0, farther = 0.0;
    precise vec3 light = vec3(0.0);
#if RANGE_HAS_XY
    precise vec2 aside = vec2(0.0);
#endif
    for (int k = 0; k < REACH; ++k) {
        if (!(weights[k] > 0.0 && same_surface(view, level, nearest, depths[k]))) continue;
        weight += weights[k];
        farther += weights[k] * (depths[k] - nearest);
        light += weights[k] * to_linear(colors[k]);
#if RANGE_HAS_XY
        aside += weights[k] * (sample_xy(indices[k]) - place);
#endif
    }
    depth += farther / weight;
    color = to_srgb(light / weight);
#if RANGE_HAS_XY
    place += aside / weight;
#endif
#endif
    out_depths[i] = depth;
    out_looks[i] = packUnorm4x8(vec4(color, max(floor(present / inside + 0.5), 1.0) / 255.0));
#if RANGE_HAS_XY
    out_xy[i] = place;
#endif
}

void main() {
    if (item() >= item_count) return;
    RangeView view = range_view(number);
    RangeLevel fine = range_level(view, level), coarse = range_level(view, level + 1);
    int runs = (coarse.size.x + run - 1) / run, which = int(first + item());
    ivec2 at = ivec2(run * (which % runs), which / runs);
    int end = min(at.x + run, coarse.size.x);
    for (; at.x < end; ++at.x) reduce(view, fine, at, at.y * coarse.size.x + at.x - page);
}
