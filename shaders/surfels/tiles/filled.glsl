// What two fillings of lists count (TileLists): the first, and that of what the first left. discs: those that are listed, and those
// that are left to the second.
struct Filling { uint large_count, list_length, longest, sent, discs[2]; };
layout(std430, binding = STORAGE_FILLED) buffer Filled { Filling fillings[2]; };
