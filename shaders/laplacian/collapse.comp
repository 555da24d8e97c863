// A level of the merged picture from its band and the next coarser level. TOP: there is none. CAPTURED: where a level has no
// samples, the coarser one alone is shown.
#include "common/item.glsl"
#include "laplacian/levels.glsl"

layout(binding = TEXTURE_DETAIL) uniform samplerBuffer coarser;
layout(std430, binding = STORAGE_MERGED_BANDS) buffer Merged { vec4 merged[]; };

void main() {
    uint n = item();
    if (n >= item_count) return;
    int i = out_start + int(n);
    vec4 here = merged[i];
#if CAPTURED && !TOP
    vec4 coarse = expanded(coarser, size, start, split(int(n), out_size.x));
    if (here.a + coarse.a == 0.0) return;
    here = vec4((here.a > 0.0 ? here.rgb / here.a : vec3(0.0)) + coarse.rgb, 1.0);
#else
    if (here.a == 0.0) return;
    here.rgb /= here.a;
#if !TOP
    here.rgb += expanded(coarser, size, start, split(int(n), out_size.x)).rgb;
#endif
#endif
    merged[i] = here;
}
