// A list in a buffer, with the work groups of an indirect dispatch over it beside its length.
layout(std430, binding = STORAGE_LIST) buffer List { uint list[]; };
layout(std430, binding = STORAGE_DISPATCH) buffer Dispatch { uint groups_x, groups_y, groups_z, list_count; };

// Work groups that such a list needs, in columns of groups_y: a driver need not allow more than GROUP_LIMIT
// along one dimension.
uint columns_for(uint count) {
    uint column = uint(GROUP) * groups_y;
    return (count + column - 1u) / column;
}

// Takes `count` slots; returns the first. Work groups are counted as the list reaches them.
uint reserve(uint count) {
    uint first = atomicAdd(list_count, count);
    uint columns = columns_for(first + count);
    if (columns != columns_for(first)) atomicMax(groups_x, columns);
    return first;
}
