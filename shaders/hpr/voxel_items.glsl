// The voxel of a point. COPIES: but for those in whose place a lower row is.
#include "hpr/voxels.glsl"

#if COPIES
layout(binding = TEXTURE_COPIES) uniform usamplerBuffer copies;
#endif

void scatter(uint i) {
#if COPIES
    if (texelFetch(copies, int(i)).r != NOTHING) return;
#endif
    visit(place_of(voxel_of(point_at(i))), 0u, i);
}
