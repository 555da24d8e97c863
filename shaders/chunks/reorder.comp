// Positions of points in the order of chunks, a run of them.
#include "common/item.glsl"

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;  // by row
layout(binding = TEXTURE_CHUNK_ROWS) uniform usamplerBuffer chunk_rows;
layout(std430, binding = STORAGE_ARRANGED) writeonly buffer Arranged { float arranged[]; };  // from the first of the run on

uniform uint first;

void main() {
    uint i = item();
    if (i >= item_count) return;
    vec3 position = texelFetch(positions, int(texelFetch(chunk_rows, int(first + i)).r)).xyz;
    for (uint k = 0u; k < 3u; ++k) arranged[3u * i + k] = position[k];
}
