// The radius at which a point's disc closes the gaps round it: how far the part of its tangent plane reaches that is
// nearer to it than to any other point, the farthest corner of its Voronoi cell. Copies, order and far points of the
// same list change nothing, so that lists need no order.
//
// At a border a cell does not end; it counts as BORDER times as far as it reaches to most sides. Where it reaches about
// as far to opposite sides, points lie in rows that are far apart: it counts up to ROWS times as far.
// LISTED: invocations are of the points in the list, else of slots. ENDED: no radius at a border or on a line. What
// cells cannot tell stays 0. FITTED: ellipses and planes as well (surfels/gaps/fit.glsl);
// TRUSTED: also of points in rows, as the scan stores normals; else LIMITED, where points lie on no plane.
//
// A point that lies off much denser ones, almost alone, is no surface: its disc is no larger than theirs. Rounds of the
// search find it after these (LISTED). LAST: a point whose cell never ends is as large as the nearest that is found.
// Both go by radii of earlier rounds alone, since those of this round come in any order.
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
layout(std430, binding = STORAGE_RADII) buffer Radii { float radii[]; };
#if FITTED
#define LIMITED !TRUSTED
#include "surfels/gaps/fit.glsl"
#endif

#if !LISTED
uniform uint first;
#endif

const float EVEN = 1.5;  // times as far as to the opposite side

// One over how far the cell counts in four directions. along, against: one over how far it reaches, and to the opposite
// sides; most_sides: to most. rows: ROWS, or BORDER where the point has no normal, so that nothing tells of rows.
vec4 bounded(vec4 along, vec4 against, float most_sides, float rows) {
    bvec4 even = lessThanEqual(max(along, against), EVEN * min(along, against));
    return max(along, most_sides / mix(vec4(BORDER), vec4(rows), even));
}

// Whether it may reach about as far to opposite sides, of which one is beyond what cells tell.
bool is_undecided(vec4 along, vec4 against, float most_sides) {
    vec4 nearer = max(along, against), farther = min(along, against);
    vec4 both = max(nearer / min(EVEN, most_sides * KNOWN / (0.5 * BORDER)), farther);
    return any(lessThan(both, vec4(0.5 / KNOWN)));
}

float least_of(vec4 v) { return min(min(v.x, v.y), min(v.z, v.w)); }

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

#if LISTED && !ENDED
const float AROUND = 1.75;  // times as far as the cell reaches: from where on points are not beside it
const float DENSER = 3.0;  // times smaller discs
const float APART = 0.25;  // times as far as the cell reaches: a nearer point is no neighbour, but the same place
const int SURFACE = 3;     // neighbours that are as sparse: so many are a surface

// The largest disc around a point that is alone beside denser points, scan units; 0 for others. reach: cells.
float denser_around(ivec3 cell, vec3 place, float reach) {
    float largest = 0.0;
    int alike = 0;
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y) {
            int run = int(list_of(cell + ivec3(-1, y, z))), last = int(texelFetch(starts, run + 3).r);
            for (int j = int(texelFetch(starts, run).r); j < last; ++j) {
                vec4 other = texelFetch(slots, j);
                float away = distance(other.xyz, place) / (reach * cell_size);
                if (away > AROUND) continue;
                float radius = radii[floatBitsToUint(other.w)];
                if (radius > 0.0 && radius * DENSER < reach * cell_size) largest = max(largest, radius);
                else if (away > APART) ++alike;
            }
        }
    return alike < SURFACE ? largest : 0.0;
}
#endif

#if LAST
const float EARLIER = KNOWN / WIDER;  // cells: what an earlier round finds is smaller

// The radius of the nearest point in the cells around that an earlier round found; 0 without one.
float nearest_radius(ivec3 cell, vec3 place) {
    float nearest = UNKNOWN, radius = 0.0;
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y) {
            int run = int(list_of(cell + ivec3(-1, y, z))), last = int(texelFetch(starts, run + 3).r);
            for (int j = int(texelFetch(starts, run).r); j < last; ++j) {
                vec4 other = texelFetch(slots, j);
                float away = distance(other.xyz, place), its = radii[floatBitsToUint(other.w)];
                if (its <= 0.0 || its > EARLIER * cell_size) continue;
                if (away > nearest || (away == nearest && its <= radius)) continue;
                nearest = away;
                radius = its;
            }
        }
    return radius;
}
#endif

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
    bool has_normal = len > 0.0 && len < UNKNOWN;
    n = has_normal ? n / len : vec3(0.0, 0.0, 1.0);
    vec3 u = tangent_of(n), v = cross(n, u);
    clear_cell();
    ivec3 cell = cell_of(place);
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y) {
            int run = int(list_of(cell + ivec3(-1, y, z))), last = int(texelFetch(starts, run + 3).r);
            for (int j = int(texelFetch(starts, run).r); j < last; ++j) {
                vec4 other = texelFetch(slots, j);
                vec3 d = (other.xyz - place) / cell_size;
                float squared = dot(d, d);
#if LIMITED
                take_close(squared);
#endif
                bound_cell(vec2(dot(d, u), dot(d, v)) / max(squared, 1e-30));
            }
        }
    float most_sides = fourth(-lowest[0], highest[0]);
#if ENDED
    // Across a line of points both sides are far.
    vec4 across = max(-lowest[0], highest[0]);
    float farthest = least_of(min(-lowest[0], highest[0]));
    if (farthest < most_sides / BORDER || any(lessThan(across, across.zwxy / BORDER))) return;
#endif
    vec4 forth = highest[0], back = -lowest[0];
    bool is_open = has_normal && is_undecided(forth, back, most_sides);
    float rows = has_normal ? ROWS : BORDER;
    forth = bounded(forth, back, most_sides, rows);
    back = bounded(back, highest[0], most_sides, rows);
    float inverse = least_of(min(forth, back));
    float reach = 0.5 / max(inverse, 1e-30);
    if (is_open || reach > KNOWN) {
#if LAST
        radii[row] = nearest_radius(cell, place);
#endif
        return;
    }
#if LISTED && !ENDED
    float denser = denser_around(cell, place, reach);
    if (denser > 0.0) {
        radii[row] = denser;
        return;
    }
#endif
    radii[row] = reach * cell_size;
#if FITTED
    if (!has_normal) return;
    begin_fit(0.5 / max(forth, 1e-30), 0.5 / max(back, 1e-30), SPARE * reach, u, v);
#if !TRUSTED
    // Where points lie in rows, the nearest ones do not tell a normal, and a disc covers more of what lies beside.
    if (rough.lengths.x > ROW * rough.lengths.y) return;
#endif
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y) {
            int run = int(list_of(cell + ivec3(-1, y, z))), last = int(texelFetch(starts, run + 3).r);
            for (int j = int(texelFetch(starts, run).r); j < last; ++j) {
                vec4 other = texelFetch(slots, j);
                vec3 d = (other.xyz - place) / cell_size;
                float squared = dot(d, d);
#if LIMITED
                take_extent(d, squared, n, u, v);
#endif
                take_corner(d, squared);
                take_neighbor(d, squared, n, j);
            }
        }
#if LIMITED
    limit = limit_of_plane();
    radii[row] = min(reach, limit / SPARE) * cell_size;
#endif
    store_fit(row, place, n);
#endif
}
