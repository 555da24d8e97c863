// Points from buffer textures. SAMPLED: only the listed rows are drawn. PACKED: normal, radius and half-axes are words.
#include "amplify/point.glsl"
#include "amplify/radii.glsl"

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
#if !PACKED
layout(binding = TEXTURE_NORMALS) uniform samplerBuffer normals;
#if HAS_AXES
layout(binding = TEXTURE_AXES) uniform samplerBuffer axes;
#endif
#endif
#ifdef FED_COLOR
layout(binding = TEXTURE_COLORS) uniform samplerBuffer fed_colors;
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
    vec3 position = texelFetch(positions, at).xyz;
    float radius = stored_radius(at);
#ifdef FED_COLOR
    fed_color = texelFetch(fed_colors, at).rgb;
#endif
#if PACKED
    uvec3 words = texelFetch(splats, at).xyz;
    vec3 normal = packed_normal(words);
#else
    vec3 normal = texelFetch(normals, at).xyz;
#endif
#if HAS_AXES && PACKED
    vec4 half_axes = packed_axes(words, radius);
#elif HAS_AXES
    vec4 half_axes = texelFetch(axes, at);
#else
    const vec4 half_axes = vec4(0.0);
#endif
    return Point(position, normal, radius, half_axes, uint(at));
}
