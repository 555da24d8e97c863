// Copies a buffer, sixteen bytes at a time.
#include "common/item.glsl"

layout(std430, binding = STORAGE_WORDS) readonly buffer Words { uvec4 words[]; };
layout(std430, binding = STORAGE_LIST) writeonly buffer List { uvec4 copied[]; };

void main() {
    uint i = item();
    if (i < item_count) copied[i] = words[i];
}
