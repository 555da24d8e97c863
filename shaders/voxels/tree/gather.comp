// What is drawn of the shown nodes of an octree, one after the other: those of the deepest level first, of each level in their
// order. CUBES: from the middles of their cells on; else where the surface is in these.
#include "common/item.glsl"
#include "voxels/tree/node.glsl"
#include "voxels/tree/sight.glsl"

layout(binding = TEXTURE_NODE_CELLS) uniform usamplerBuffer node_cells;
layout(binding = TEXTURE_NODE_OFFSETS) uniform usamplerBuffer node_offsets;  // three texels a node
layout(binding = TEXTURE_RADII) uniform samplerBuffer node_radii;
layout(binding = TEXTURE_NORMALS) uniform samplerBuffer node_normals;
layout(binding = TEXTURE_NODE_COLORS) uniform usamplerBuffer node_colors;  // four bytes
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer shown_nodes;
layout(std430, binding = STORAGE_CUT_POSITIONS) writeonly buffer Positions { float positions[]; };
layout(std430, binding = STORAGE_CUT_NORMALS) writeonly buffer Normals { float normals[]; };
layout(std430, binding = STORAGE_CUT_RADII) writeonly buffer Radii { float radii[]; };
layout(std430, binding = STORAGE_CUT_COLORS) writeonly buffer Colors { uint colors[]; };
layout(std430, binding = STORAGE_CUT_OCTANTS) writeonly buffer Octants { uint octants[]; };

void main() {
    uint i = item(), place = i;
    if (i >= item_count) return;
    int level = MOST_LEVELS - 1;
    for (; level > 0 && place >= shown[level]; --level) place -= shown[level];
    Level of = levels[level];
    uint node = texelFetch(shown_nodes, int(of.start + place)).r;
    int at = int(node);
    precise dvec3 middle = middle_of(cell_of(texelFetch(node_cells, at).xy), of.edge);
    uvec3 offset = uvec3(texelFetch(node_offsets, 3 * at).r, texelFetch(node_offsets, 3 * at + 1).r, texelFetch(node_offsets, 3 * at + 2).r);
    precise double step = of.edge / 65536.0LF;
    precise double half_step = step / 2.0LF, half_edge = of.edge / 2.0LF;
    precise double shift = half_edge - half_step;
    precise dvec3 off = dvec3(offset) * step;
    off = off - shift;
    precise dvec3 position = middle + off;
    position = position + dvec3(low[0], low[1], low[2]);
    vec3 normal = texelFetch(node_normals, at).xyz;
    for (uint k = 0u; k < 3u; ++k) {
        positions[3u * i + k] = float(position[k]);
        normals[3u * i + k] = normal[k];
    }
    radii[i] = texelFetch(node_radii, at).r;
#if COLORED
    colors[i] = texelFetch(node_colors, at).r;
#endif
    octants[i] = node;
}
