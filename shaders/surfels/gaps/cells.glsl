// A point's list is that of its cell. The first two lists come again behind the last one, so that runs of three never
// wrap around. THINNED: where points are much denser than cells some are left out, whatever their order: copies of a
// point together.
#include "surfels/gaps/cell.glsl"
#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;
#endif
#if THINNED
layout(binding = TEXTURE_RADII) uniform samplerBuffer radii;

// 0..1, from a place's bits.
float chance(vec3 place) {
    uvec3 bits = floatBitsToUint(place);
    uint mixed = bits.x * 0x9E3779B1u ^ bits.y * 0x85EBCA77u ^ bits.z * 0xC2B2AE3Du;
    mixed = (mixed ^ mixed >> 15) * 0x2C1B3C6Du;
    return float(mixed >> 8) / 16777216.0;
}

// Whether it is one of about ENOUGH of a cell's width and height of surface, going by the radius that it got.
bool is_kept(uint row, vec3 place) {
    float share = texelFetch(radii, int(row)).r / cell_size;
    return share == 0.0 || chance(place) < ENOUGH * share * share;
}
#endif

void scatter(uint i) {
#if SAMPLED
    i = texelFetch(drawn_rows, int(i)).r;
#endif
    vec3 place = texelFetch(positions, int(i)).xyz;
#if THINNED
    if (!is_kept(i, place)) return;
#endif
    uint list = list_of(cell_of(place));
    visit(list, 0u, i);
    if (list < 2u) visit(uint(list_mask) + 1u + list, 0u, i);
}
