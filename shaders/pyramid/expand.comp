// A level from the next coarser one. FILLS: only what of this level is not there.
#include "pyramid/samples.glsl"

#if FILLS
layout(binding = TEXTURE_KNOWN_WEIGHTS) uniform samplerBuffer known_weights;
uniform float enough;  // weight of the coarser level, whichever surface it is of
#endif

void main() {
    uint i = item();
    if (i >= item_count) return;
    ivec2 at = ivec2(int(i) % out_size.x, int(i) / out_size.x);
    ivec2 low = max((at - FIRST - COUNT + 2) >> 1, 0), high = min((at - FIRST) >> 1, size - 1);
#if FILLS
    if (is_there(texelFetch(known_weights, int(i)).r)) return;
#endif
    begin_sample();
#if FRONT
    for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x) tell_sample(ivec2(x, y));
#endif
    for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x) {
            ivec2 tap = at - 2 * ivec2(x, y) - FIRST;
            add_sample(ivec2(x, y), taps[tap.x] * taps[tap.y]);
        }
    precise vec4 value = mean_sample();
#if FILLS
    if (present < enough * inside) return;
#endif
    store_sample(i, value, weight / inside);
}
