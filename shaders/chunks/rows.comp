// The points of listed chunks, chunk after chunk: their rows, and, REORDERED, their indices in the order of chunks.
#include "common/item.glsl"

layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;
#if !IN_FILE
layout(binding = TEXTURE_CHUNK_ROWS) uniform usamplerBuffer chunk_rows;
#endif
layout(std430, binding = STORAGE_DRAWN_ROWS) writeonly buffer DrawnRows { uint drawn_rows[]; };
#if REORDERED
layout(std430, binding = STORAGE_DRAWN_INDICES) writeonly buffer DrawnIndices { uint drawn_indices[]; };
#endif

void main() {
    uint i = item();
    if (i >= item_count) return;
    uint index = texelFetch(listed, int(i / uint(CHUNK))).r * uint(CHUNK) + i % uint(CHUNK), row = index;
#if !IN_FILE
    row = texelFetch(chunk_rows, int(index)).r;
#endif
    drawn_rows[i] = row;
#if REORDERED
    drawn_indices[i] = index;
#endif
}
