// What one filling of lists counts (TileLists), and the rows of large discs. discs: those that are listed, and those that are left
// to a second filling.
layout(std430, binding = STORAGE_LARGE) buffer Large { uint large_count, list_length, longest, sent, discs[2], large[]; };
