// A level of a view's differences from the next finer one: means of what is there, how much of the surroundings that is, and
// the mean of the view's shares. LOWEST: that is the picture itself.
#include "common/item.glsl"
#include "laplacian/levels.glsl"
#include "laplacian/pictures.glsl"

#if LOWEST
layout(binding = TEXTURE_LOOKS) uniform usamplerBuffer picture;
#else
layout(binding = TEXTURE_SAMPLES) uniform samplerBuffer bands;
layout(binding = TEXTURE_WEIGHTS) uniform samplerBuffer shares;
#endif
layout(std430, binding = STORAGE_BANDS) writeonly buffer Bands { vec4 out_bands[]; };
layout(std430, binding = STORAGE_BAND_SHARES) writeonly buffer Shares { vec2 out_shares[]; };

void main() {
    uint n = item();
    if (n >= item_count) return;
    ivec2 at = split(int(n), out_size.x), first = 2 * at + FIRST;
    ivec2 low = max(first, 0), high = min(first + COUNT, size);
    vec4 sum = vec4(0.0);
    float inside = 0.0;
    vec2 share = vec2(0.0);
    for (int y = low.y; y < high.y; ++y)
        for (int x = low.x; x < high.x; ++x) {
            float tap = taps[x - first.x] * taps[y - first.y];
#if LOWEST
            uvec2 words = texelFetch(picture, y * size.x + x).xy;
            vec2 own = unpack_shares(words);
            vec4 here = vec4(unpack_difference(words), own.y > 0.0 ? 1.0 : 0.0);
#else
            vec4 here = texelFetch(bands, start + y * size.x + x);
            vec2 own = texelFetch(shares, start + y * size.x + x).rg;
#endif
            inside += tap;
            share += tap * own;
            sum += tap * here.a * vec4(here.rgb, 1.0);
        }
    out_bands[out_start + int(n)] = sum.a > 0.0 ? vec4(sum.rgb / sum.a, sum.a / inside) : vec4(0.0);
    out_shares[out_start + int(n)] = share / inside;
}
