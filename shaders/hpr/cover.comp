// Whether points are visible: those are hidden that others surround, before them, whose discs reach them. Those that lie
// on one side only may be the same surface, seen aslant. An invocation for each disc, which looks at those in the
// cells around.
#include "common/item.glsl"
#include "common/list.glsl"
#include "hpr/windows.glsl"

uniform float clear;  // of the reach
layout(binding = TEXTURE_SIGHTS) uniform samplerBuffer discs;
layout(binding = TEXTURE_STARTS) uniform usamplerBuffer starts;
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;
layout(binding = TEXTURE_WINDOWS) uniform isamplerBuffer windows;
layout(std430, binding = STORAGE_VISIBLE) writeonly buffer Visible { uint visible[]; };

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
    if (i >= list_count) return;
    vec4 own = texelFetch(discs, int(i));
    if (own.w < 0.0) return;
    uint entry = texelFetch(listed, int(i)).r;
    ivec3 place = ivec3(cell_of(own.xy), face_in(entry));
    int window = max(WINDOW, texelFetch(windows, block_at(ivec3(block_of(place.xy), place.z))).r);
    // Seen from the eye along the point's own direction, another lies at turned * apart / (ahead + skew . apart): the
    // tangent of the angle between them, over that of half a face.
    float t2 = tangent * tangent, out_from = dot(own.xy, own.xy), ahead = 1.0 + t2 * out_from;
    float stretch = sqrt(ahead), along = out_from > 0.0 ? (1.0 - stretch) / out_from : 0.0;
    vec3 turned = vec3(stretch + along * own.x * own.x, along * own.x * own.y, stretch + along * own.y * own.y);
    vec2 skew = t2 * own.xy;
    uvec2 covered = uvec2(0u);
    ivec2 low = max(place.xy - window, ivec2(0)), high = min(place.xy + window, ivec2(line_length() - 1));
    for (int y = low.y; y <= high.y; ++y) {
        int line = int(cell_at(ivec3(0, y, place.z)));
        int last = int(texelFetch(starts, line + high.x + 1).r);
        for (int j = int(texelFetch(starts, line + low.x).r); j < last; ++j) {
            vec4 other = texelFetch(discs, j);
            vec2 apart = other.xy - own.xy;
            float scale = ahead + dot(skew, apart), reach = abs(other.w);
            vec2 away = vec2(dot(turned.xy, apart), dot(turned.yz, apart));
            float squared = dot(away, away), reached = reach * scale;
            float behind = (own.z - other.z) * scale;
            float least = depth_unit(other.z) * (clear * reached + STEEP * sqrt(squared));
            bool covers = scale > 0.0 && squared <= reached * reached;
            if (squared == 0.0) {
                if (covers && behind > 0.0) covered = uvec2(~0u);
            } else if (covers && behind > least) {
                uint part = part_of(away);
                covered |= part < 32u ? uvec2(1u << part, 0u) : uvec2(0u, 1u << (part - 32u));
            }
        }
    }
    visible[row_in(entry)] = uint(has_half_turn(~covered));
}
