// Points from buffer textures. SAMPLED: only the listed rows are drawn.
#include "amplify/point.glsl"

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
layout(binding = TEXTURE_NORMALS) uniform samplerBuffer normals;
#include "amplify/radii.glsl"
#if HAS_AXES
layout(binding = TEXTURE_AXES) uniform samplerBuffer axes;
#endif
#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;
#endif

// The row of the i-th point that is drawn.
int drawn_row(int i) {
#if SAMPLED
    return int(texelFetch(drawn_rows, i).r);
#else
    return i;
#endif
}

Point texel_point(int at) {
#if HAS_RADIUS
    float radius = texelFetch(radii, at).r;
#else
    const float radius = 0.0;
#endif
#if HAS_AXES
    vec4 half_axes = texelFetch(axes, at);
#else
    const vec4 half_axes = vec4(0.0);
#endif
    return Point(texelFetch(positions, at).xyz, texelFetch(normals, at).xyz, radius, half_axes, uint(at));
}
