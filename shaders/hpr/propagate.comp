// Propagation, step by step. TAKE 0: each listed sector looks whether a neighbour's candidate is better for it, and
// goes into the next list if so. TAKE 1: those sectors take what they found, and their neighbours go into the next
// list, each once; but for the LAST step. Nobody reads what others write in the same pass, so that the result is the
// same in any order.
#include "common/item.glsl"
#include "hpr/next_list.glsl"
#include "hpr/sectors.glsl"

layout(binding = TEXTURE_SPOTS) uniform samplerBuffer spots;
#if TAKE
uniform uint step_number;
layout(binding = TEXTURE_FOUND) uniform usamplerBuffer found_rows;
layout(std430, binding = STORAGE_KEYS) buffer Keys { uint keys[]; };
layout(std430, binding = STORAGE_BEST) buffer Rows { uint rows[]; };
layout(std430, binding = STORAGE_STAMPS) buffer Stamps { uint stamps[]; };
#else
layout(binding = TEXTURE_KEYS) uniform usamplerBuffer keys;
layout(binding = TEXTURE_BEST) uniform usamplerBuffer rows;
layout(std430, binding = STORAGE_NEXT_ROWS) buffer Found { uint found_rows[]; };
#endif

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint sector = list[i];
    ivec3 place = place_of(sector);
    vec3 direction = direction_at(place);
#if TAKE
    uint row = texelFetch(found_rows, int(i)).r;
    rows[sector] = row;
    keys[sector] = key_of(texelFetch(spots, int(row)).xyz, direction);
#if !LAST
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
            uint neighbor = neighbor_at(place, ivec2(x, y));
            if (neighbor == NOTHING || neighbor == sector || stamps[neighbor] == NOTHING) continue;
            if (atomicExchange(stamps[neighbor], step_number) != step_number) next_list[reserve_next(1u)] = neighbor;
        }
#endif
#else
    uint key = texelFetch(keys, int(sector)).r, row = texelFetch(rows, int(sector)).r, own = row;
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
            uint neighbor = neighbor_at(place, ivec2(x, y));
            if (neighbor == NOTHING) continue;
            uint other = texelFetch(rows, int(neighbor)).r;
            if (other == NOTHING || other == row) continue;
            uint found = key_of(texelFetch(spots, int(other)).xyz, direction);
            if (found > key || (found == key && other > row)) continue;
            key = found;
            row = other;
        }
    if (row == own) return;
    uint slot = reserve_next(1u);
    next_list[slot] = sector;
    found_rows[slot] = row;
#endif
}
