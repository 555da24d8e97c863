// A list in a buffer, with the work groups of an indirect dispatch over it beside its length.
layout(std430, binding = 2) buffer List { uint list[]; };
layout(std430, binding = 3) buffer Dispatch { uint groups_x, groups_y, groups_z, list_count; };

// Takes `count` slots; returns the first. Work groups of 256 are counted as the list reaches
// them, in columns of groups_y: a driver need not allow more than 65 535 along one dimension.
uint reserve(uint count) {
    uint first = atomicAdd(list_count, count);
    uint column = 256u * groups_y;
    uint columns = (first + count + column - 1u) / column;
    if (columns != (first + column - 1u) / column) atomicMax(groups_x, columns);
    return first;
}
