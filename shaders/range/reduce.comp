// A level of a range view from the next finer one. Depths, colours and measured places are means over samples
// of one surface, the nearest in reach, weighted by taps and alphas; NEAREST: those of the nearest sample, the first
// in the order of rows. Alpha is the mean of those in reach, there or not.
#include "common/item.glsl"
#include "common/color.glsl"
#include "range/samples.glsl"

// The level that is written.
layout(std430, binding = STORAGE_RANGE_DEPTHS) writeonly buffer Depths { float out_depths[]; };
layout(std430, binding = STORAGE_RANGE_LOOKS) writeonly buffer Looks { uint out_looks[]; };
#if RANGE_HAS_XY
layout(std430, binding = STORAGE_RANGE_XY) writeonly buffer Xy { vec2 out_xy[]; };
#endif

uniform int number;  // of the view
uniform int level;   // that is read
uniform uint first;  // sample that is made by this call

const float taps[] = TAPS;

void main() {
    uint i = first + item();
    if (item() >= item_count) return;
    RangeView view = range_view(number);
    RangeLevel fine = range_level(view, level), coarse = range_level(view, level + 1);
    ivec2 at = ivec2(int(i) % coarse.size.x, int(i) / coarse.size.x);
    ivec2 begin = 2 * at + FIRST, low = max(begin, 0), high = min(begin + COUNT, fine.size);
    float nearest = uintBitsToFloat(NO_DEPTH), present = 0.0, inside = 0.0;
    int chosen = 0;
    for (int y = low.y; y < high.y; ++y)
        for (int x = low.x; x < high.x; ++x) {
            int index = sample_index(fine, ivec2(x, y));
            float tap = taps[x - begin.x] * taps[y - begin.y];
            float alpha = round(255.0 * sample_look(index).a), depth = sample_depth(index);
            inside += tap;
            present += tap * alpha;
            bool nearer = alpha > 0.0 && depth < nearest;
            nearest = nearer ? depth : nearest;
            chosen = nearer ? index : chosen;
        }
    if (present == 0.0) {
        out_depths[i] = 0.0;
        out_looks[i] = 0u;
#if RANGE_HAS_XY
        out_xy[i] = vec2(0.0);
#endif
        return;
    }
    float alpha = max(floor(present / inside + 0.5), 1.0);
#if NEAREST
    out_depths[i] = nearest;
    out_looks[i] = packUnorm4x8(vec4(sample_look(chosen).rgb, alpha / 255.0));
#if RANGE_HAS_XY
    out_xy[i] = texelFetch(range_xy, chosen).xy;
#endif
#else
    // Relative to the nearest, so that what is the same everywhere stays the same.
    precise float weight = 0.0, farther = 0.0;
    precise vec3 color = vec3(0.0);
#if RANGE_HAS_XY
    vec2 zero = texelFetch(range_xy, chosen).xy;
    precise vec2 aside = vec2(0.0);
#endif
    for (int y = low.y; y < high.y; ++y)
        for (int x = low.x; x < high.x; ++x) {
            int index = sample_index(fine, ivec2(x, y));
            vec4 look = sample_look(index);
            float depth = sample_depth(index);
            if (!(look.a > 0.0 && same_surface(view, level, nearest, depth))) continue;
            float part = taps[x - begin.x] * taps[y - begin.y] * round(255.0 * look.a);
            weight += part;
            farther += part * (depth - nearest);
            color += part * to_linear(look.rgb);
#if RANGE_HAS_XY
            aside += part * (texelFetch(range_xy, index).xy - zero);
#endif
        }
    out_depths[i] = nearest + farther / weight;
    out_looks[i] = packUnorm4x8(vec4(to_srgb(color / weight), alpha / 255.0));
#if RANGE_HAS_XY
    out_xy[i] = zero + aside / weight;
#endif
#endif
}
