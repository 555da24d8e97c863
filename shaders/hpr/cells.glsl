// Cells that points are listed by, for what lies around them. The faces of a cube have FARTHEST more of them on each side,
// so that what lies beyond their edges is found as well: points of other faces are listed there once more.
// An entry is a row of the pose, and the face that it is listed on.
#include "hpr/sights.glsl"

layout(binding = TEXTURE_SPOTS) uniform samplerBuffer spots;

const uint FACE_SHIFT = 29u;
const int MARGIN = CUBE == 1 ? FARTHEST : 0;

uint row_in(uint entry) { return CUBE == 1 ? entry & (1u << FACE_SHIFT) - 1u : entry; }

int face_in(uint entry) { return CUBE == 1 ? int(entry >> FACE_SHIFT) : 0; }

int line_length() { return edge + 2 * MARGIN; }

uint cell_count() { return uint(SECTOR_FACES * line_length() * line_length()); }

uint cell_at(ivec3 place) { return uint((place.z * line_length() + place.y) * line_length() + place.x); }

// Column and line of a sight on its face.
ivec2 cell_of(vec2 tangents) {
#if CUBE
    bvec2 outside = greaterThan(abs(tangents), vec2(1.0));
    precise vec2 angles = angles_of(mix(tangents, 1.0 / tangents, outside));
    angles = mix(angles, sign(tangents) * 1.5707963 - angles, outside);
#else
    vec2 angles = angles_of(tangents);
#endif
    return ivec2(floor((angles / half_angle + 1.0) * (0.5 * float(edge)))) + MARGIN;
}

bool is_cell(ivec2 cell) { return all(greaterThanEqual(cell, ivec2(0))) && all(lessThan(cell, ivec2(line_length()))); }
