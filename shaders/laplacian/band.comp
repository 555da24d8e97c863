// A view's band of a level, its differences beyond the next coarser level's, is added to those of all views by its shares.
// TOP: the coarsest level, of which all is band.
#include "common/item.glsl"
#include "laplacian/levels.glsl"

layout(binding = TEXTURE_SAMPLES) uniform samplerBuffer bands;
layout(binding = TEXTURE_WEIGHTS) uniform samplerBuffer shares;
layout(std430, binding = STORAGE_MERGED_BANDS) buffer Merged { vec4 merged[]; };

void main() {
    uint n = item();
    if (n >= item_count) return;
    int i = out_start + int(n);
    float share = texelFetch(shares, i)[TOP];
    if (share == 0.0) return;
    vec3 band = texelFetch(bands, i).rgb;
#if !TOP
    band -= expanded(bands, size, start, split(int(n), out_size.x)).rgb;
#endif
    merged[i] += share * vec4(band, 1.0);
}
