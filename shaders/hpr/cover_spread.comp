// How far apart the listed points lie around each: by the number of them that lie in a ball around it. Those that have
// too few there go into the next list, LAST into none.
#include "common/item.glsl"
#include "common/list.glsl"
#include "hpr/next_list.glsl"
#include "hpr/sights.glsl"

uniform float ball;
layout(binding = TEXTURE_SPOTS) uniform samplerBuffer spots;
layout(binding = TEXTURE_STARTS) uniform usamplerBuffer starts;
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;
#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;
#endif
layout(std430, binding = STORAGE_SIGHTS) buffer Sights { vec4 sights[]; };

uint count_near(vec3 spot, ivec3 place, int face) {
    uint count = 0u;
    vec3 own;
    find_sight(spot, face, own);
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
            uint cell = neighbor_at(place, ivec2(x, y));
            if (cell == NOTHING) continue;
            int last = int(texelFetch(starts, int(cell) + 1).r);
            for (int j = int(texelFetch(starts, int(cell)).r); j < last; ++j) {
                vec3 other;
                if (!find_sight(texelFetch(spots, int(texelFetch(listed, j).r)).xyz, face, other)) continue;
                float aside = angle_between(own, other), before = depth_before(own, other);
                count += uint(aside * aside + before * before <= ball * ball);
            }
        }
    return count;
}

void main() {
    uint i = item();
    if (i >= list_count) return;
#if SAMPLED
    uint row = texelFetch(drawn_rows, int(list[i])).r;
#else
    uint row = list[i];
#endif
    vec3 spot = texelFetch(spots, int(row)).xyz;
    uint sector = sector_of(spot), count = 0u;
    if (sector != NOTHING) count = count_near(spot, place_of(sector), face_at(spot));
#if !LAST
    if (count < ENOUGH) {
        next_list[reserve_next(1u)] = list[i];
        return;
    }
#endif
    sights[row] = vec4(spot, REACH * ball * sqrt(3.14159265 / float(max(count, ENOUGH))));
}
