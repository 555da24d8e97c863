// Lists the points that may be visible, those not beyond the limit of their cell, on each face that has a cell for them;
// and marks points visible that lie in no cell, since nothing is known that hides them, the others not.
// COPIES: a point in whose place one of a lower row is is not visible, where that is looked at. Each invocation looks at a run of points, so
// that the counter is touched once a run.
#include "common/item.glsl"
#include "common/list.glsl"
#include "hpr/cells.glsl"
#include "hpr/drawn_row.glsl"

uniform uint point_count;
layout(binding = TEXTURE_HOMES) uniform usamplerBuffer homes;
layout(binding = TEXTURE_LIMITS) uniform samplerBuffer limits;
#if COPIES
layout(binding = TEXTURE_COPIES) uniform usamplerBuffer copies;
uniform uint lots;  // those below it are looked at
#endif
layout(std430, binding = STORAGE_VISIBLE) writeonly buffer Visible { uint visible[]; };

const int RUN = 8;

// A bit for each face.
uint faces_of(uint row) {
#if CUBE
    vec3 spot = texelFetch(spots, int(row)).xyz, sight;
    uint faces = 0u;
    for (int face = 0; face < SECTOR_FACES; ++face)
        if (find_sight(spot, face, sight) && is_cell(cell_of(sight.xy))) faces |= 1u << face;
    return faces;
#else
    return 1u;
#endif
}

void main() {
    uint first = item() * uint(RUN), found = 0u;
    uint faces[RUN];
    for (int n = 0; n < RUN; ++n) {
        faces[n] = 0u;
        uint i = first + uint(n);
        if (i >= point_count) continue;
        uint row = drawn_row(i);
        uvec2 home = texelFetch(homes, int(i)).rg;
        bool near = home.x != NOTHING;
        if (near) near = key_from(home.y) <= texelFetch(limits, int(home.x)).r;
        bool alone = home.x == NOTHING && home.y == 0u;
#if COPIES
        if (texelFetch(copies, int(row)).r < lots) alone = near = false;
#endif
        visible[row] = uint(alone);
        if (near) faces[n] = faces_of(row);
        found += uint(bitCount(faces[n]));
    }
    if (found == 0u) return;
    uint slot = reserve(found);
    for (int n = 0; n < RUN; ++n)
        for (uint left = faces[n]; left != 0u; left &= left - 1u)
            list[slot++] = drawn_row(first + uint(n)) | uint(findLSB(left)) << FACE_SHIFT;
}
