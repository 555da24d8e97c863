// What pixels show of the samples that were scattered into them. <source> says what a sample is.
#include "common/item.glsl"
#include "common/list.glsl"
#include "common/split.glsl"
#include "common/view.glsl"
#include "pyramidal/pixels.glsl"
#include <source>

#if SUMS
layout(binding = TEXTURE_SUMS) uniform usamplerBuffer sums;  // of point spread functions: weight, and times linear colour

const float steps[] = STEPS;
#endif

layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;  // pixels

void main() {
    uint n = item();
    if (n >= list_count) return;
    int i = int(texelFetch(listed, int(n)).r);
    float depth = uintBitsToFloat(depths[i]);
    uint row;
    Seen seen;
    own_pixel(split(i, view_size.x), rows[i], depth, row, seen);
#if SUMS && COLOR
    float weight = float(int(texelFetch(sums, 4 * i).r)) * steps[0];
    for (int k = 0; k < 3; ++k)
        if (weight > 0.0) seen.color[k] = float(int(texelFetch(sums, 4 * i + k + 1).r)) * steps[k + 1] / weight;
#endif
    store(i, depth, row, 0, seen);
}
