// A list in a buffer, with the work groups of an indirect dispatch over it beside its length.
layout(std430, binding = 2) buffer List { uint list[]; };
layout(std430, binding = 3) buffer Dispatch { uint groups_x, groups_y, groups_z, list_count; };

// Work groups of 256 that such a list needs, in columns of groups_y: a driver need not allow more than
// 65 535 along one dimension.
uint columns_for(uint count) {
    uint column = 256u * groups_y;
    return (count + column - 1u) / column;
}

// Takes `count` slots; returns the first. Work groups are counted as the list reaches them.
uint reserve(uint count) {
    uint first = atomicAdd(list_count, count);
    uint columns = columns_for(first + count);
    if (columns != columns_for(first)) atomicMax(groups_x, columns);
    return first;
}
