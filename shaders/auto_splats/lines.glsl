// Neighborhoods of points on a line.
layout(std430, binding = STORAGE_NEXT) readonly buffer Next { float next[]; };

bool is_listed(uint i) { return next[i] < 0.0; }
