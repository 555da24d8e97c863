// Exclusive prefix sums of words, modulo 2^32. Each work group has a block of words, each invocation a run of it.
// STEP 0 gives the sum of each block; STEP 1, once those are prefix sums themselves, the sum before each word.
// A file says what the words are (`word_of(i)`, twice the same) and takes their sums (`take_sum(i, sum)`), from
// binding points 0 to 5.
#include "common/item.glsl"
#include "common/meet.glsl"

uniform uint word_count;
uniform uint run;  // words of an invocation

#if BLOCKS
layout(std430, binding = STORAGE_BLOCK_SUMS) buffer BlockSums { uint block_sums[]; };
#endif
#include <words>

#if STEP == 0
shared uint total;
#else
shared uint sums[GROUP];
#endif

void main() {
    uint me = gl_LocalInvocationID.x, block = item() / uint(GROUP);
    uint first = min(item() * run, word_count), last = min(first + run, word_count);
    uint sum = 0u;
    for (uint i = first; i < last; ++i) sum += word_of(i);
#if STEP == 0
    if (me == 0u) total = 0u;
    meet();
    atomicAdd(total, sum);
    meet();
    if (me == 0u && first < word_count) block_sums[block] = total;
#else
    sums[me] = sum;
    meet();
    for (uint step = 1u; step < uint(GROUP); step *= 2u) {
        uint before = me >= step ? sums[me - step] : 0u;
        meet();
        sums[me] += before;
        meet();
    }
    uint before = sums[me] - sum;
#if BLOCKS
    if (first < word_count) before += block_sums[block];
#endif
    for (uint i = first; i < last; ++i) {
        uint word = word_of(i);
        take_sum(i, before);
        before += word;
    }
#endif
}
