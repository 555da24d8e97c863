// Points from buffer textures. SAMPLED: only the listed rows are drawn. PACKED: normal, radius and half-axes are words.
// REORDERED: they stand in another order, and places in that are listed in place of rows.
#include "amplify/point.glsl"
#include "amplify/radii.glsl"

#if REORDERED
// Two to four texels a point: position and radius; normal and row; half-axes and cell where points have these.
layout(binding = TEXTURE_ARRANGED) uniform usamplerBuffer arranged;
#else
layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
#endif
#if !PACKED && !REORDERED
layout(binding = TEXTURE_NORMALS) uniform samplerBuffer normals;
#if HAS_AXES
layout(binding = TEXTURE_AXES) uniform samplerBuffer axes;
#endif
#if HAS_CELLS
layout(binding = TEXTURE_CELLS) uniform samplerBuffer cells;
#endif
#endif
#ifdef FED_COLOR
layout(binding = TEXTURE_COLORS) uniform samplerBuffer fed_colors;
#endif
#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;
#endif

// The row, or the place, of the i-th point that is drawn.
int drawn_row(int i) {
#if SAMPLED
    return int(texelFetch(drawn_rows, i).r);
#else
    return i;
#endif
}

Point texel_point(int at) {
#if REORDERED
    at *= 2 + HAS_AXES + HAS_CELLS;
    uvec4 first = texelFetch(arranged, at), second = texelFetch(arranged, at + 1);
#if HAS_AXES
    vec4 half_axes = uintBitsToFloat(texelFetch(arranged, at + 2));
#else
    const vec4 half_axes = vec4(0.0);
#endif
#if HAS_CELLS
    vec4 cell = uintBitsToFloat(texelFetch(arranged, at + 3));
#else
    const vec4 cell = vec4(0.0);
#endif
    return Point(
        uintBitsToFloat(first.xyz), uintBitsToFloat(second.xyz), uintBitsToFloat(first.w), half_axes, cell, second.w
    );
#else
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
#if HAS_CELLS
    vec4 cell = texelFetch(cells, at);
#else
    const vec4 cell = vec4(0.0);
#endif
    return Point(position, normal, radius, half_axes, cell, uint(at));
#endif
}
