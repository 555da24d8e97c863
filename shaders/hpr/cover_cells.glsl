// The cell of a listed entry.
#include "common/list.glsl"
#include "hpr/cells.glsl"

void scatter(uint i) {
    uint entry = list[i];
    int face = face_in(entry);
    vec3 sight;
    find_sight(texelFetch(spots, int(row_in(entry))).xyz, face, sight);
    visit(cell_at(ivec3(cell_of(sight.xy), face)), 0u, entry);
}
