// Participants in the order of their cells: place, and twice the row, 1 more where it is hidden. Near ones are
// counted, and those that a pixel shows are listed, or, where it `culls`, near ones of these.
#include "auto_splats/seen.glsl"

layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;  // rows
layout(std430, binding = STORAGE_COUNTS) buffer Counts { uint counts[]; };  // of each coarse cell
layout(std430, binding = STORAGE_SLOTS) writeonly buffer Slots { uvec4 slots[]; };

void main() {
    uint i = item();
    if (i >= item_count) return;
    uint row = texelFetch(listed, int(i)).r;
    vec3 place = texelFetch(positions, int(row)).xyz;
    vec2 pixel;
    float depth;
    bool seen = is_seen(row, pixel, depth), hidden = !seen && in_picture(pixel);
    slots[i] = uvec4(floatBitsToUint(place * unit), 2u * row + uint(hidden));
    bool near = is_near(pixel, depth);
    if (near) atomicAdd(counts[coarse_cell(pixel)], 1u);
    if (seen && (near || !culls)) add(i, row);
}
