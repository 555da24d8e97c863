// A second list beside that of common/list.glsl, which is made while that one is worked on.
layout(std430, binding = STORAGE_NEXT_LIST) buffer NextList { uint next_list[]; };
layout(std430, binding = STORAGE_NEXT_DISPATCH) buffer NextDispatch {
    uint next_groups_x, next_groups_y, next_groups_z, next_count;
};

uint next_columns_for(uint count) {
    uint column = uint(GROUP) * next_groups_y;
    return (count + column - 1u) / column;
}

uint reserve_next(uint count) {
    uint first = atomicAdd(next_count, count);
    uint columns = next_columns_for(first + count);
    if (columns != next_columns_for(first)) atomicMax(next_groups_x, columns);
    return first;
}
