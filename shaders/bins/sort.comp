// A pass of a stable radix sort of pairs, by four bits of their first word. Each invocation has a run of pairs: STEP 0
// counts those with each digit; STEP 1, once counts are prefix sums, moves them. Within a run one invocation moves
// them in their order, so that no order is lost. LAST: second words alone are written.
#include "common/item.glsl"

layout(binding = TEXTURE_PAIRS) uniform usamplerBuffer pairs;
layout(std430, binding = STORAGE_DIGITS) buffer Places { uint places[]; };  // of each digit, for each run
#if STEP == 1 && LAST
layout(std430, binding = STORAGE_SORTED) writeonly buffer Sorted { uint sorted[]; };
#elif STEP == 1
layout(std430, binding = STORAGE_SORTED) writeonly buffer Sorted { uvec2 sorted[]; };
#endif

uniform uint pair_count;
uniform uint shift;

void main() {
    uint run = item(), runs = (pair_count + RUN - 1u) / RUN;
    if (run >= runs) return;
    uint last = min((run + 1u) * RUN, pair_count);
    for (uint i = run * RUN; i < last; ++i) {
        uvec2 pair = texelFetch(pairs, int(i)).xy;
        uint place = (pair.x >> shift & 15u) * runs + run;
#if STEP == 0
        ++places[place];
#elif LAST
        sorted[places[place]++] = pair.y;
#else
        sorted[places[place]++] = pair;
#endif
    }
}
