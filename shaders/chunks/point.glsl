// The points of chunks, by their place in the order of these. IN_FILE: that is the order of rows. REORDERED: the points
// stand in it.
#include "amplify/texels.glsl"
#if !IN_FILE
layout(binding = TEXTURE_CHUNK_ROWS) uniform usamplerBuffer chunk_rows;
#endif

Point point_at(uint place) {
#if !IN_FILE && !REORDERED
    place = texelFetch(chunk_rows, int(place)).r;
#endif
    return texel_point(int(place));
}
