// A level from the next finer one. NEAREST: of the samples in reach the one whose first value is least, the
// first of those in the order of rows; else their mean.
#include "pyramid/samples.glsl"

void main() {
    uint i = item();
    if (i >= item_count) return;
    ivec2 at = ivec2(int(i) % out_size.x, int(i) / out_size.x);
    ivec2 first = 2 * at + FIRST, low = max(first, 0), high = min(first + COUNT, size);
    begin_sample();
#if FRONT
    for (int y = low.y; y < high.y; ++y)
        for (int x = low.x; x < high.x; ++x) tell_sample(ivec2(x, y));
#endif
#if NEAREST
    vec4 nearest = vec4(uintBitsToFloat(NO_DEPTH));
    bool found = false;
#endif
    for (int y = low.y; y < high.y; ++y)
        for (int x = low.x; x < high.x; ++x) {
            add_sample(ivec2(x, y), taps[x - first.x] * taps[y - first.y]);
#if NEAREST
            vec4 here = texelFetch(samples, y * size.x + x);
            bool better = is_there(texelFetch(weights, y * size.x + x).r) && (!found || here.x < nearest.x);
            nearest = better ? here : nearest;
            found = found || better;
#endif
        }
#if NEAREST
    store_sample(i, found ? nearest : vec4(0.0), weight / inside);
#else
    store_sample(i, mean_sample(), weight / inside);
#endif
}
