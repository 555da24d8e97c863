// Participants in the order of their cells: place, and row. Those not behind what is active are counted.
#include "common/item.glsl"
#include "auto_splats/place.glsl"

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;  // rows
layout(binding = TEXTURE_ACTIVE) uniform samplerBuffer active_to;
layout(std430, binding = STORAGE_COUNTS) buffer Counts { uint counts[]; };  // of each coarse cell
layout(std430, binding = STORAGE_SLOTS) writeonly buffer Slots { uvec4 slots[]; };

void main() {
    uint i = item();
    if (i >= item_count) return;
    uint row = texelFetch(listed, int(i)).r;
    vec3 place = texelFetch(positions, int(row)).xyz, view = to_view(place);
    slots[i] = uvec4(floatBitsToUint(place * unit), row);
    vec2 pixel;
    if (!find_pixel(view, pixel)) return;
    int cell = coarse_cell(pixel);
    if (-view.z <= texelFetch(active_to, cell).r) atomicAdd(counts[cell], 1u);
}
