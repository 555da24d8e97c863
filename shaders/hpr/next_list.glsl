// A second list beside that of common/list.glsl, which is made while that one is worked on.
#include "common/list.glsl"

layout(std430, binding = STORAGE_NEXT_LIST) buffer NextList { uint next_list[]; };
layout(std430, binding = STORAGE_NEXT_DISPATCH) buffer NextDispatch {
    uint next_groups_x, next_groups_y, next_groups_z, next_count;
};

uint reserve_next(uint count) {
    uint first = atomicAdd(next_count, count);
    uint columns = columns_for(first + count, next_groups_y);
    if (columns != columns_for(first, next_groups_y)) atomicMax(next_groups_x, columns);
    return first;
}
