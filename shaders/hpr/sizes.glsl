// How far the middles of a candidate's listed sectors pass it at most (Machado e Silva 2014, 5.5): kept as what is least.
#include "common/list.glsl"
#include "hpr/extents.glsl"

layout(binding = TEXTURE_CANDIDATES) uniform usamplerBuffer candidates;  // a row for each sector

void scatter(uint i) {
    uint sector = list[i];
    uint row = texelFetch(candidates, int(sector)).r;
    if (row == NOTHING) return;
    visit(row, NO_DEPTH - 1u - floatBitsToUint(sector_away(spot_of(row), direction_of(sector))), row);
}
