// Words that are 1 for one of each so many items and stand nowhere in memory; those items are written down.
layout(std430, binding = 0) writeonly buffer Found { uint found[]; };
uniform uint every;

uint word_of(uint i) { return uint(i % every == every - 1u); }

void take_sum(uint i, uint sum) {
    if (word_of(i) > 0u) found[sum] = i;
}
