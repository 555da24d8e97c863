// Facts of points as drawn: the box round them and the longest radius; some of them, for quantiles. INSIDE: the box round those
// in another box.
#include "common/item.glsl"

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
layout(binding = TEXTURE_RADII) uniform samplerBuffer radii;
// Lower and upper corner and the longest radius, as words of the same order.
layout(std430, binding = STORAGE_CUT_FACTS) buffer Facts { uint lowest[3], highest[3], longest, reserved; vec4 sampled[]; };

uniform uint stride;
#if INSIDE
uniform dvec3 inside_low, inside_high;
#endif

shared uint group_lowest[3], group_highest[3], group_longest;

uint ordered(float value) {
    uint bits = floatBitsToUint(value);
    return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}

void main() {
    uint i = item(), me = gl_LocalInvocationID.x;
    if (me < 3u) group_lowest[me] = NOTHING, group_highest[me] = 0u;
    if (me == 0u) group_longest = 0u;
    memoryBarrierShared();
    barrier();
    if (i < item_count) {
        vec3 position = texelFetch(positions, int(i)).xyz;
        float radius = texelFetch(radii, int(i)).r;
#if INSIDE
        bool counts = all(greaterThanEqual(dvec3(position), inside_low)) && all(lessThanEqual(dvec3(position), inside_high));
#else
        const bool counts = true;
        if (i % stride == 0u) sampled[i / stride] = vec4(position, radius);
#endif
        if (counts) {
            for (uint k = 0u; k < 3u; ++k) {
                atomicMin(group_lowest[k], ordered(position[k]));
                atomicMax(group_highest[k], ordered(position[k]));
            }
            atomicMax(group_longest, floatBitsToUint(radius));
        }
    }
    memoryBarrierShared();
    barrier();
    if (me < 3u) {
        atomicMin(lowest[me], group_lowest[me]);
        atomicMax(highest[me], group_highest[me]);
    }
    if (me == 0u) atomicMax(longest, group_longest);
}
