// The points' own radii, where they have any.
#if HAS_RADIUS
layout(binding = TEXTURE_RADII) uniform samplerBuffer radii;
#endif
