// The home of each disc that is listed, once they are counted. NUMBERED: which disc each point has is written down.
#include "surfels/tiles/reach.glsl"

layout(binding = TEXTURE_REACH) uniform usamplerBuffer reach;
#if SIDE == 1 || SIDE == 2
layout(binding = TEXTURE_AWAY) uniform usamplerBuffer away_depths;  // as surfels/tiles/cells.glsl has them
#endif
#if NUMBERED
layout(std430, binding = STORAGE_NUMBERS) writeonly buffer Numbers { uint numbers[]; };  // of points, NOTHING: no disc
#endif

uniform uint first_disc, first_home;  // the number of the first disc, and where the lists of homes begin

bool is_listed(uint i, uvec2 words) {
#if SIDE == 1 || SIDE == 2
    if ((texelFetch(away_depths, int(i)).r != 0u) != (SIDE == 2)) return false;
#endif
    return words.y != 0u;
}

void scatter(uint i) {
    uvec2 words = texelFetch(reach, int(i)).xy;
    uint disc = NOTHING;
    if (is_listed(i, words)) disc = first_disc + visit(home_of(tiles_of(unpacked_parts(words)).xy), 0u, i) - first_home;
#if NUMBERED
    numbers[i] = disc;
#endif
}
