// The listed sectors take over the candidates that they found, and their neighbours go into the next list, each once; but
// for the LAST step.
#include "common/item.glsl"
#include "hpr/next_list.glsl"
#include "hpr/sectors.glsl"

uniform uint step_number;
layout(binding = TEXTURE_FOUND) uniform usamplerBuffer found_rows;
layout(std430, binding = STORAGE_BEST) writeonly buffer Rows { uint rows[]; };
layout(std430, binding = STORAGE_STAMPS) buffer Stamps { uint stamps[]; };

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint sector = list[i];
    rows[sector] = texelFetch(found_rows, int(i)).r;
#if !LAST
    ivec3 place = place_of(sector);
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
            uint neighbor = neighbor_at(place, ivec2(x, y));
            if (neighbor == NOTHING || neighbor == sector || stamps[neighbor] == NOTHING) continue;
            if (atomicExchange(stamps[neighbor], step_number) != step_number) next_list[reserve_next(1u)] = neighbor;
        }
#endif
}
