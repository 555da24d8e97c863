// Cells of a grid in space. Each has a list, which others share that are far away: their points tell nothing.
#include <params>

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;

ivec3 cell_of(vec3 place) { return ivec3(clamp(floor(place / cell_size), -1e9, 1e9)); }

// The list of a cell; those of its neighbours along x follow one another, so that points near in space are near in
// memory.
uint list_of(ivec3 cell) {
    return uint(cell.x) + uint(row_stride) * uint(cell.y) + uint(layer_stride) * uint(cell.z) & uint(list_mask);
}
