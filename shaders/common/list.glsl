// A list in a buffer, with the work groups of an indirect dispatch over it beside its length.
layout(std430, binding = STORAGE_LIST) buffer List { uint list[]; };
layout(std430, binding = STORAGE_DISPATCH) buffer Dispatch { uint groups_x, groups_y, groups_z, list_count; };

// Columns of so many work groups that a list needs: a driver need not allow more than GROUP_LIMIT along one dimension.
uint columns_for(uint count, uint groups) {
    uint column = uint(GROUP) * groups;
    return (count + column - 1u) / column;
}

// Takes `count` slots; returns the first. Work groups are counted as the list reaches them.
uint reserve(uint count) {
    uint first = atomicAdd(list_count, count);
    uint columns = columns_for(first + count, groups_y);
    if (columns != columns_for(first, groups_y)) atomicMax(groups_x, columns);
    return first;
}
