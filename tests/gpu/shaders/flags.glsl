// Flags in a buffer, a word each.
layout(std430, binding = 0) readonly buffer Flags { uint flags[]; };

bool is_listed(uint i) { return flags[i] != 0u; }
