// The radius at which a point's disc closes the gaps round it: how far the part of its tangent plane reaches that is
// nearer to it than to any other point, the farthest corner of its Voronoi cell. Copies, order and far points of the
// same list change nothing, so that lists need no order.
//
// At a border a cell does not end; it counts as twice as far as it reaches to most sides. LISTED: invocations are of
// the points in the list, else of slots. ENDED: no radius at a border or on a line. What cells cannot tell stays 0.
#include "common/item.glsl"
#if LISTED
#include "common/list.glsl"
#endif
#include "common/cell_reach.glsl"
#include "common/tangent.glsl"
#include "surfels/gaps/cell.glsl"

layout(binding = TEXTURE_SLOTS) uniform samplerBuffer slots;
layout(binding = TEXTURE_STARTS) uniform usamplerBuffer starts;
layout(binding = TEXTURE_NORMALS) uniform samplerBuffer normals;
layout(std430, binding = STORAGE_RADII) writeonly buffer Radii { float radii[]; };

#if !LISTED
uniform uint first;
#endif

// Four numbers, ascending.
vec4 sorted(vec4 v) {
    v = vec4(min(v.xy, v.zw), max(v.xy, v.zw));
    v = vec4(min(v.xz, v.yw), max(v.xz, v.yw)).xzyw;
    return vec4(v.x, min(v.y, v.z), max(v.y, v.z), v.w);
}

// The fourth least of eight numbers.
float fourth(vec4 a, vec4 b) {
    a = sorted(a);
    b = sorted(b);
    return min(min(min(a.w, b.w), max(a.z, b.x)), min(max(a.y, b.y), max(a.x, b.z)));
}

void main() {
#if LISTED
    uint i = item();
    if (i >= list_count) return;
    uint row = list[i];
    vec3 place = texelFetch(positions, int(row)).xyz;
#else
    uint i = item();
    if (i >= item_count) return;
    vec4 slot = texelFetch(slots, int(first + i));
    uint row = floatBitsToUint(slot.w);
    vec3 place = slot.xyz;
#endif
    vec3 n = texelFetch(normals, int(row)).xyz;
    float len = length(n);
    n = len > 0.0 && len < UNKNOWN ? n / len : vec3(0.0, 0.0, 1.0);
    vec3 u = tangent_of(n), v = cross(n, u);
    clear_cell();
    ivec3 cell = cell_of(place);
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y) {
            int run = int(list_of(cell + ivec3(-1, y, z))), last = int(texelFetch(starts, run + 3).r);
            for (int j = int(texelFetch(starts, run).r); j < last; ++j) {
                vec3 d = (texelFetch(slots, j).xyz - place) / cell_size;
                bound_cell(vec2(dot(d, u), dot(d, v)) / max(dot(d, d), 1e-30));
            }
        }
    vec4 least = min(-lowest[0], highest[0]);
    float most_sides = fourth(-lowest[0], highest[0]);
    float farthest = min(min(least.x, least.y), min(least.z, least.w));
#if ENDED
    // Across a line of points both sides are far.
    vec4 across = max(-lowest[0], highest[0]);
    if (farthest < most_sides / BORDER || any(lessThan(across, across.zwxy / BORDER))) return;
#endif
    float inverse = max(farthest, most_sides / BORDER);
    float reach = 0.5 / max(inverse, 1e-30);
    if (reach <= KNOWN) radii[row] = reach * cell_size;
}
