// The points' own radii, as stored; 0 where they have none. RADII_APART: not those of words.
#include "amplify/packed.glsl"

#if PACKED
layout(binding = TEXTURE_SPLATS) uniform usamplerBuffer splats;  // as amplify/packed.glsl has them
#endif
#if RADII_APART
layout(binding = TEXTURE_RADII) uniform samplerBuffer radii;
#endif

float stored_radius(int at) {
#if RADII_APART
    return texelFetch(radii, at).r;
#elif HAS_RADIUS
    return packed_radius(texelFetch(splats, at).xyz);
#else
    return 0.0;
#endif
}
