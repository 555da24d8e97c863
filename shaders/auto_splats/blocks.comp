// The farthest depth that each block of 8 x 8 pixels shows; +inf where one of them shows nothing.
#include "common/item.glsl"
#include "common/split.glsl"
#include "auto_splats/block.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(std430, binding = STORAGE_FARTHEST) writeonly buffer Farthest { uint farthest[]; };  // depth bits

void main() {
    uint i = item();
    if (i >= item_count) return;
    ivec2 first = split(int(i), blocks_of(view_size).x) * BLOCK, end = min(first + BLOCK, view_size);
    uint most = 0u;
    for (int y = first.y; y < end.y; ++y)
        for (int x = first.x; x < end.x; ++x) most = max(most, texelFetch(depths, y * view_size.x + x).r);
    farthest[i] = most;
}
