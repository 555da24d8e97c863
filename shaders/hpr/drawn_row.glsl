// The row of a place among the points that are looked at. SAMPLED: a list says which these are; else all.
#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;

uint drawn_row(uint i) { return texelFetch(drawn_rows, int(i)).r; }
#else
uint drawn_row(uint i) { return i; }
#endif
