// What one filling of lists counts (TileLists), and the rows of large discs.
layout(std430, binding = STORAGE_LARGE) buffer Large { uint large_count, list_length, away, longest, sent, discs, large[]; };
