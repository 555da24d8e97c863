// Participants in the order of their cells: place, and row. Those not behind what is active are counted, and
// those of them that a pixel shows are listed.
#include "auto_splats/seen.glsl"

layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;  // rows
layout(std430, binding = STORAGE_COUNTS) buffer Counts { uint counts[]; };  // of each coarse cell
layout(std430, binding = STORAGE_SLOTS) writeonly buffer Slots { uvec4 slots[]; };

void main() {
    uint i = item();
    if (i >= item_count) return;
    uint row = texelFetch(listed, int(i)).r;
    vec3 place = texelFetch(positions, int(row)).xyz;
    slots[i] = uvec4(floatBitsToUint(place * unit), row);
    vec2 pixel;
    float depth;
    bool seen = is_seen(row, pixel, depth);
    if (!is_active(pixel, depth)) return;
    atomicAdd(counts[coarse_cell(pixel)], 1u);
    if (seen) add(i, row);
}
