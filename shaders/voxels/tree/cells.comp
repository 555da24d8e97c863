// The cells of the children of each node of a level.
#include "common/item.glsl"
#include "voxels/tree/node.glsl"

layout(binding = TEXTURE_NODE_MASKS) uniform usamplerBuffer node_masks;
layout(binding = TEXTURE_FIRST_CHILDREN) uniform usamplerBuffer first_children;
layout(std430, binding = STORAGE_NODE_CELLS) buffer Cells { uvec2 cells[]; };

uniform uint start, next_start;  // the numbers of the first nodes of the level and the next

void main() {
    uint node = start + item();
    if (item() >= item_count) return;
    uint mask = texelFetch(node_masks, int(node)).r, child = next_start + texelFetch(first_children, int(node)).r;
    uvec3 cell = 2u * cell_of(cells[node]);
    for (uint octant = 0u; octant < 8u; ++octant)
        if ((mask >> octant & 1u) != 0u) cells[child++] = words_of(cell + (uvec3(octant) >> uvec3(0, 1, 2) & 1u));
}
