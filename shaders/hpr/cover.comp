// Whether points are visible: those are hidden that others surround, before them, whose discs reach them. Those that lie
// on one side only may be the same surface, seen aslant. LISTED: of listed points; else of all. COPIES: but for those
// in whose place a lower row is.
#include "common/item.glsl"
#if LISTED
#include "common/list.glsl"
#else
layout(binding = TEXTURE_HOMES) uniform usamplerBuffer homes;
#endif
#include "hpr/sights.glsl"

uniform float clear;  // of the reach
layout(binding = TEXTURE_SPOTS) uniform samplerBuffer spots;
layout(binding = TEXTURE_SIGHTS) uniform samplerBuffer sights;
layout(binding = TEXTURE_STARTS) uniform usamplerBuffer starts;
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;
#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;
#endif
#if COPIES
layout(binding = TEXTURE_COPIES) uniform usamplerBuffer copies;
#endif
layout(std430, binding = STORAGE_VISIBLE) buffer Visible { uint visible[]; };

// One of 64 parts of a turn, alike under half turns.
uint part_of(vec2 apart) {
    float down = apart.y / (abs(apart.x) + abs(apart.y));
    return uint(16.0 * (apart.x >= 0.0 ? 1.0 - down : 3.0 + down)) & 63u;
}

uvec2 turned_by(uvec2 parts, int count) { return parts << count | parts.yx >> (32 - count); }

// Whether 31 parts side by side, half a turn less one, are among these.
bool has_half_turn(uvec2 parts) {
    parts &= turned_by(parts, 1);
    parts &= turned_by(parts, 2);
    parts &= turned_by(parts, 4);
    parts &= turned_by(parts, 8);
    return any(notEqual(parts & turned_by(parts, 15), uvec2(0u)));
}

void main() {
    uint i = item();
#if LISTED
    if (i >= list_count) return;
    i = list[i];
#else
    if (i >= item_count || texelFetch(homes, int(i)).r == NOTHING) return;
#endif
#if SAMPLED
    uint row = texelFetch(drawn_rows, int(i)).r;
#else
    uint row = i;
#endif
#if COPIES
    if (texelFetch(copies, int(row)).r != 0u) {
        visible[row] = 0u;
        return;
    }
#endif
    vec3 spot = texelFetch(spots, int(row)).xyz, own;
    uint cell = sector_of(spot);
    if (cell == NOTHING) return;
    int face = face_at(spot);
    find_sight(spot, face, own);
    uvec2 covered = uvec2(0u);
    int last = int(texelFetch(starts, int(cell) + 1).r);
    for (int j = int(texelFetch(starts, int(cell)).r); j < last; ++j) {
        vec4 sight = texelFetch(sights, int(texelFetch(listed, j).r));
        vec3 other;
        if (!find_sight(sight.xyz, face, other)) continue;
        float aside = angle_between(own, other);
        float before = depth_before(other, own);
        if (aside > sight.w || before <= (aside > 0.0 ? clear * sight.w + STEEP * aside : 0.0)) continue;
        if (other.xy == own.xy) {
            covered = uvec2(~0u);
            break;
        }
        uint part = part_of(other.xy - own.xy);
        covered |= part < 32u ? uvec2(1u << part, 0u) : uvec2(0u, 1u << (part - 32u));
    }
    visible[row] = uint(has_half_turn(~covered));
}
