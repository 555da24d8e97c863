// Propagation: a sector takes over the best of its own candidate and those of its neighbours. Nobody reads what others
// write in the same pass, so that the result is the same in any order.
// EVERY 1: all sectors of the list get what they find. EVERY 0: those that find another candidate go into the next list,
// and what they found stands at their place there (hpr/take.comp).
#include "common/item.glsl"
#include "hpr/next_list.glsl"
#include "hpr/sectors.glsl"

layout(binding = TEXTURE_SPOTS) uniform samplerBuffer spots;
layout(binding = TEXTURE_BEST) uniform usamplerBuffer rows;
layout(std430, binding = STORAGE_NEXT_ROWS) writeonly buffer Found { uint found_rows[]; };

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint sector = list[i];
    ivec3 place = place_of(sector);
    vec3 direction = direction_at(place);
    uint candidates[9];
    for (int n = 0; n < 9; ++n) {
        uint neighbor = neighbor_at(place, ivec2(n % 3 - 1, n / 3 - 1));
        candidates[n] = neighbor == NOTHING ? NOTHING : texelFetch(rows, int(neighbor)).r;
    }
    // Neighbours often have the same candidate: in ascending order, each is looked at once.
    uint row = NOTHING, key = NOTHING, next = 0u;
    while (true) {
        uint other = NOTHING;
        for (int n = 0; n < 9; ++n)
            if (candidates[n] >= next) other = min(other, candidates[n]);
        if (other == NOTHING) break;
        uint found = key_of(texelFetch(spots, int(other)).xyz, direction);
        if (found < key) {
            key = found;
            row = other;
        }
        next = other + 1u;
    }
#if EVERY
    found_rows[sector] = row;
#else
    if (row == candidates[4]) return;
    uint slot = reserve_next(1u);
    next_list[slot] = sector;
    found_rows[slot] = row;
#endif
}
