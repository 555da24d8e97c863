// Levels 1 and up of a picture's pyramid, one after another, and the steps between them (viewer/gpu/pyramid.py): coarse cell i
// is a mean of the fine ones 2 i + FIRST and the COUNT - 1 that follow, weighted by taps.
#include "common/split.glsl"

uniform ivec2 size;      // of the level that is read
uniform ivec2 out_size;  // of the one that is written
uniform int start;       // of the level that is read, in the buffer of all
uniform int out_start;

const float taps[] = TAPS;

// What a coarser level has at a fine cell: the mean of the cells that it is part of, by their weights (alpha).
vec4 expanded(samplerBuffer level, ivec2 coarse_size, int coarse_start, ivec2 at) {
    ivec2 low = max((at - FIRST - COUNT + 2) >> 1, 0), high = min((at - FIRST) >> 1, coarse_size - 1);
    vec4 sum = vec4(0.0);
    for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x) {
            ivec2 tap = at - 2 * ivec2(x, y) - FIRST;
            vec4 here = texelFetch(level, coarse_start + y * coarse_size.x + x);
            sum += taps[tap.x] * taps[tap.y] * here.a * vec4(here.rgb, 1.0);
        }
    return sum.a > 0.0 ? vec4(sum.rgb / sum.a, 1.0) : vec4(0.0);
}
