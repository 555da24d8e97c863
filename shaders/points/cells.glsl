// A point's cells are the pixels of its square, its key is its depth. SAMPLED: a list says which points.
// CHUNKED: a list says which chunks, in whose order positions are, and with SAMPLED a list of rows.
// KEPT: a list has rows. STRIDED: one of each `stride` rows in a run, whose turn it is.
// PART: positions are those of a run of all points, from row `first` on.
// FILTERED: those that are not visible are left out. SINGLE: squares are of one pixel.
#include "common/view.glsl"
#if CHUNKED || KEPT
#include "common/list.glsl"
#endif

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;
#endif
#if FILTERED
layout(binding = TEXTURE_VISIBLE) uniform usamplerBuffer visible;
#endif
#include <params>

void scatter(uint i) {
#if CHUNKED
    i = list[i / uint(CHUNK)] * uint(CHUNK) + i % uint(CHUNK);
    if (i >= uint(point_count)) return;
    vec3 position = texelFetch(positions, int(i)).xyz;
#endif
#if SAMPLED
    i = texelFetch(drawn_rows, int(i)).r;
#endif
#if KEPT
    i = list[i];
#endif
#if STRIDED
    // By chance in each run, so that nothing beats with the lines of a scan; in `stride` turns, each row once.
    i = i * uint(stride) + (uint(turn) + (i * 0x9E3779B1u >> 16)) % uint(stride);
    if (i >= uint(point_count)) return;
#endif
#if !CHUNKED
    vec3 position = texelFetch(positions, int(i)).xyz;
#endif
#if FILTERED
    if (texelFetch(visible, int(i)).r == 0u) return;
#endif
#if PART
    i += uint(first);
#endif
    vec3 view = to_view(position);
    float depth = -view.z;
    // Depths are positive, so their bits are in the order of their values.
    uint key = floatBitsToUint(depth);
    vec2 pixel = to_pixel(view);
    if (!in_depth_range(depth)) return;
#if SINGLE
    if (any(lessThan(pixel, vec2(0.0))) || any(greaterThanEqual(pixel, vec2(view_size)))) return;
    ivec2 at = ivec2(pixel);
    visit(uint(at.y * view_size.x + at.x), key, i);
#else
    // Beyond this a float cannot be turned into an int; such a point is out of view anyway.
    if (any(greaterThan(abs(pixel), vec2(1e9)))) return;
    ivec2 low = ivec2(floor(pixel - 0.5 * float(point_size - 1)));
    ivec2 first = max(low, ivec2(0));
    ivec2 last = min(low + point_size, view_size);
    for (int y = first.y; y < last.y; ++y)
        for (int x = first.x; x < last.x; ++x) visit(uint(y * view_size.x + x), key, i);
#endif
}
