// Counts, for each index, the invocations that found it in the list.
#include "common/item.glsl"
#include "common/list.glsl"

layout(std430, binding = 0) buffer Marks { uint marks[]; };

void main() {
    uint i = item();
    if (i < list_count) atomicAdd(marks[list[i]], 1u);
}
