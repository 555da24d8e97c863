// Faces between the candidates of 2 x 2 sectors (Machado e Silva 2014, 4.4): two triangles where all four differ, one where
// three do. A quad is known by a number: four for each sector, of which the first is to the right and down; the others
// are there at the edges of a cube's faces, across which not each sector is somebody's neighbour to the right or below.
#include "hpr/sectors.glsl"

layout(binding = TEXTURE_CANDIDATES) uniform usamplerBuffer candidates;  // a row for each sector
layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;

// Rows of the corners of up to two triangles, ascending, so that triangles that share an edge agree on it.
struct Faces {
    uvec3 corners[2];
    int count;
};

uint candidate_at(ivec3 place, ivec2 step) {
    uint sector = neighbor_at(place, step);
    return sector == NOTHING ? NOTHING : texelFetch(candidates, int(sector)).r;
}

uvec3 ascending(uvec3 rows) {
    rows.xy = uvec2(min(rows.x, rows.y), max(rows.x, rows.y));
    rows.yz = uvec2(min(rows.y, rows.z), max(rows.y, rows.z));
    rows.xy = uvec2(min(rows.x, rows.y), max(rows.x, rows.y));
    return rows;
}

// Ascending rows: NOTHING would be last.
bool are_distinct(uvec3 rows) { return rows.x != rows.y && rows.y != rows.z && rows.z != NOTHING; }

float apart_in_space(uint a, uint b) {
    return length(texelFetch(positions, int(a)).xyz - texelFetch(positions, int(b)).xyz);
}

Faces faces_of(uint quad) {
    ivec3 place = place_of(quad >> 2);
    ivec2 way = ivec2((quad & 1u) == 0u ? 1 : -1, (quad & 2u) == 0u ? 1 : -1);
    uint a = texelFetch(candidates, int(quad >> 2)).r, b = candidate_at(place, ivec2(way.x, 0));
    uint c = candidate_at(place, ivec2(0, way.y)), d = candidate_at(place, way);
    uvec3 abc = ascending(uvec3(a, b, c)), bcd = ascending(uvec3(b, c, d));
    uvec3 abd = ascending(uvec3(a, b, d)), acd = ascending(uvec3(a, c, d));
    bool whole = are_distinct(abc) && are_distinct(bcd) && a != d;
    Faces faces;
    faces.count = whole ? 2 : 1;
    if (whole) {
        bool shorter = apart_in_space(b, c) < apart_in_space(a, d);
        faces.corners[0] = shorter ? abc : abd;
        faces.corners[1] = shorter ? bcd : acd;
        return faces;
    }
    faces.corners[0] = are_distinct(abc) ? abc : are_distinct(bcd) ? bcd : are_distinct(abd) ? abd : acd;
    faces.corners[1] = faces.corners[0];
    faces.count = int(are_distinct(faces.corners[0]));
    return faces;
}
