// Remainders and quotients of numbers that were given.
#include "common/item.glsl"
#include "common/split.glsl"

layout(std430, binding = 0) readonly buffer Numbers { int numbers[]; };
layout(std430, binding = 1) readonly buffer Divisors { int divisors[]; };
layout(std430, binding = 2) writeonly buffer Parts { ivec2 parts[]; };

void main() {
    uint i = item();
    if (i < item_count) parts[i] = split(numbers[i], divisors[i]);
}
