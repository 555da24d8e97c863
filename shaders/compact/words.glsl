// Words in a buffer, which give way to the sums before them.
layout(std430, binding = STORAGE_WORDS) buffer Words { uint words[]; };

uint word_of(uint i) { return words[i]; }

void take_sum(uint i, uint sum) { words[i] = sum; }
