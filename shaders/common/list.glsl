// A list in a buffer, with the work groups of an indirect dispatch over it beside its length.
layout(std430, binding = 2) buffer List { uint list[]; };
layout(std430, binding = 3) buffer Dispatch { uint groups_x, groups_y, groups_z, list_count; };

// Takes `count` slots; returns the first. Groups of 256 are counted as the list reaches them.
uint reserve(uint count) {
    uint first = atomicAdd(list_count, count);
    uint groups = (first + count + 255u) / 256u;
    if (groups != (first + 255u) / 256u) atomicMax(groups_x, groups);
    return first;
}
