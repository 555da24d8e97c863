// The points' own radii, as stored; 0 where they have none.
#if PACKED
layout(binding = TEXTURE_SPLATS) uniform usamplerBuffer splats;  // as amplify/packed.glsl has them
#elif HAS_RADIUS
layout(binding = TEXTURE_RADII) uniform samplerBuffer radii;
#endif

float stored_radius(int at) {
#if PACKED && HAS_RADIUS
    return uintBitsToFloat(texelFetch(splats, at).y);
#elif HAS_RADIUS
    return texelFetch(radii, at).r;
#else
    return 0.0;
#endif
}
