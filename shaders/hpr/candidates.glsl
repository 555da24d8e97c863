// A point's cell is its sector, its key how far its flip lies along the sector's direction. The first pass keeps each
// point's spot, sector and key, so that positions are read once, and, CELLS, notes which cells of sectors points fall into.
// FILTERED: points that are not visible are left out.
#include "hpr/drawn_row.glsl"
#include "hpr/sectors.glsl"

#if PASS == 0
uniform vec4 clip;  // points are left out where this plane is below 0
uniform mat4 sides;  // or one of these four, its columns
#if CELLS
uniform int cell_shift;
layout(std430, binding = STORAGE_OCCUPIED) buffer Occupied { uint occupied[]; };
#endif

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
#if FILTERED
layout(binding = TEXTURE_VISIBLE) uniform usamplerBuffer visible;
#endif
layout(std430, binding = STORAGE_POINT_SPOTS) buffer Spots { float spots[]; };
layout(std430, binding = STORAGE_HOMES) buffer Homes { uvec2 homes[]; };

uvec2 home_of(uint row, vec3 position) {
    vec3 spot;
    bool has_spot = find_spot(position, spot);
    spots[3u * row] = spot.x;
    spots[3u * row + 1u] = spot.y;
    spots[3u * row + 2u] = spot.z;
    vec4 at = vec4(position, 1.0);
    if (dot(clip, at) < 0.0 || any(lessThan(at * sides, vec4(0.0)))) return uvec2(NOTHING, NOTHING);
    if (!has_spot) return uvec2(NOTHING, 0u);
    uint sector = sector_of(spot);
    if (sector == NOTHING) return uvec2(NOTHING, 0u);
    ivec3 place = place_of(sector);
#if CELLS
    int cells = ((edge - 1) >> cell_shift) + 1;
    ivec2 cell = place.xy >> cell_shift;
    occupied[(place.z * cells + cell.y) * cells + cell.x] = 1u;
#endif
    return uvec2(sector, key_of(spot, direction_at(place)));
}
#else
layout(binding = TEXTURE_HOMES) uniform usamplerBuffer homes;
#endif

void scatter(uint i) {
    uint row = drawn_row(i);
#if PASS == 0
#if FILTERED
    if (texelFetch(visible, int(row)).r == 0u) {
        homes[i] = uvec2(NOTHING, NOTHING);
        return;
    }
#endif
    uvec2 home = home_of(row, texelFetch(positions, int(row)).xyz);
    homes[i] = home;
#else
    uvec2 home = texelFetch(homes, int(i)).rg;
#endif
    if (home.x != NOTHING) visit(home.x, home.y, row);
}
