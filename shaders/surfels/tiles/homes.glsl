// The home of each disc that is listed, once they are counted. NUMBERED: which disc each point has is written down.
#include "surfels/tiles/reach.glsl"
#include "surfels/tiles/counted.glsl"

layout(binding = TEXTURE_REACH) uniform usamplerBuffer reach;
layout(binding = TEXTURE_NOTED) uniform usamplerBuffer noted;  // points whose discs are listed
#if NUMBERED
layout(std430, binding = STORAGE_NUMBERS) writeonly buffer Numbers { uint numbers[]; };  // of points, NOTHING: no disc
#endif

void scatter(uint at) {
    if (at >= disc_count()) return;
    uint i = texelFetch(noted, int(at)).r;
    ivec4 parts = unpacked_parts(texelFetch(reach, int(i)).xy);
    uint disc = first_disc + visit(home_of(tiles_of(parts).xy), 0u, i) - first_home;
#if NUMBERED
    numbers[i] = disc;
#endif
}
