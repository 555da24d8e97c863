// Places and rows of points in the order of their lists.
#include "common/item.glsl"

layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;  // rows
layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
layout(std430, binding = STORAGE_SLOTS) writeonly buffer Slots { vec4 slots[]; };

void main() {
    uint i = item();
    if (i >= item_count) return;
    uint row = texelFetch(listed, int(i)).r;
    slots[i] = vec4(texelFetch(positions, int(row)).xyz, uintBitsToFloat(row));
}
