// Means of sums that were given.
#include "common/item.glsl"
#include "common/split.glsl"

layout(std430, binding = 0) readonly buffer Sums { uint sums[]; };
layout(std430, binding = 1) readonly buffer Counts { uint counts[]; };
layout(std430, binding = 2) writeonly buffer Means { float means[]; };

void main() {
    uint i = item();
    if (i < item_count) means[i] = means_of(uvec3(sums[i]), counts[i]).y;
}
