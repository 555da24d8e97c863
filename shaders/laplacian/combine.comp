// A view's band of a level, what its samples show beyond those of the next coarser level, is added to those of all views by its
// shares. FINEST: the level of pixels. TOP: the coarsest, of which all is band.
#include "common/item.glsl"
#include "laplacian/levels.glsl"
#include "laplacian/pictures.glsl"
#include "laplacian/sums.glsl"

#if FINEST
layout(binding = TEXTURE_LOOKS) uniform usamplerBuffer picture;
#else
layout(binding = TEXTURE_WEIGHTS) uniform samplerBuffer shares;
#endif
layout(binding = TEXTURE_SAMPLES) uniform samplerBuffer bands;  // levels of the view's samples, from 1 on
layout(std430, binding = STORAGE_MERGED_BANDS) buffer Merged { vec4 merged[]; };

uniform int sums_start;  // of the level

void main() {
    uint n = item();
    if (n >= item_count) return;
    int i = out_start + int(n);
#if FINEST
    float share = unpack_shares(texelFetch(picture, i).xy)[TOP];
#else
    float share = texelFetch(shares, i)[TOP];
#endif
    vec4 band = mean_of_splats(sums_start + int(n));
    if (share * band.a == 0.0) return;
#if !TOP
    vec4 coarse = expanded(bands, size, start, split(int(n), out_size.x));
    if (coarse.a == 0.0) return;
    band.rgb -= coarse.rgb;
#endif
    merged[i] += share * vec4(band.rgb, 1.0);
}
