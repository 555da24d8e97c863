// The k nearest participants of each listed one in space, and the splat through them (Preiner 2012, 5 and 6).
//
// Cells are searched that the image of a ball may reach. What they do not hold is behind one of the four planes
// through the eye and their outline, so that all within the distance to the nearest of these is known. Where k are
// not known yet, a larger ball follows: `again`, for those that one search has left; with several LANES for those that
// two have left, until they are known. Distances are between places as stored, so that they do not depend on the view.
#if LANES > 1
layout(local_size_x = LANES) in;
#else
#include "common/item.glsl"
#endif
#include "common/list.glsl"
#include "auto_splats/ball.glsl"
#include "auto_splats/k_nearest.glsl"
#include "auto_splats/fit.glsl"

layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;  // slots of those that are searched
// Radius of the next ball; 0: done; below 0: done, and that of a ball in which lines beside are looked for.
layout(std430, binding = STORAGE_NEXT) buffer Next { float next[]; };
layout(binding = TEXTURE_USUAL) uniform samplerBuffer usual;  // radius in each coarse cell, pixels

#if KEEPS
#include "auto_splats/kept.glsl"
#endif

#if LANES > 1
shared float lanes_squared[LANES * K];
shared uint lanes_rows[LANES * K];

// Gives each lane the nearest that any of them took.
void merge_lanes(int lane) {
    for (int k = 0; k < K; ++k) {
        lanes_squared[lane * K + k] = near_squared[k];
        lanes_rows[lane * K + k] = near_rows[k];
    }
    barrier();
    clear_nearest();
    int taken = list_count > 0u ? LANES * K : 0;  // graphics cards take long to compile what they unroll
    for (int i = 0; i < taken; ++i) take_squared(lanes_squared[i], lanes_rows[i]);
    barrier();
}
#endif

float known;  // distance within which the last search took all participants, in the scan's size

// The extent of the neighborhood as far as one search tells. radius: of the ball, scan units.
Extent search(vec3 place, float radius, float usual_radius, int lane) {
    ivec4 cells = cells_of(radius);
    clear_nearest();
    take_from(cells, place, lane);
#if LANES > 1
    merge_lanes(lane);
#endif
    float within = known_within(cells);
    known = within < UNKNOWN ? within * unit : UNKNOWN;
    return extent_of(known, usual_radius * unit);
}

// The radius that is searched next, 0: none. A little wider: what it touches is within.
float wider(Extent extent) { return extent.search / unit * 1.0001; }

#if LANES == 1
uniform bool again;
uniform uint first;  // of those listed, else

// The radius that is searched first: as large as this row's neighborhood was in the last picture that it had one in, of
// whatever pose; else what most are within.
float first_ball(uint row, float usual_radius) {
    float before = extents[3u * row];
    return usual_radius * (before > 0.0 ? clamp(before / usual_radius * 1.001, 0.1, 1.2) : FIRST_BALL);
}
#endif

void main() {
#if LANES == 1
    uint i = item();
    if (i >= (again ? list_count : item_count)) return;
    uint n = again ? list[i] : first + i;
#else
    uint i = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (i >= list_count / uint(GROUP)) return;  // which counts GROUP for each
    uint n = list[i];
#endif
    uvec4 slot = texelFetch(slots, int(texelFetch(listed, int(n)).r));
    uint row = slot.w >> 1;
    vec3 place = uintBitsToFloat(slot.xyz);
    center = to_view(texelFetch(positions, int(row)).xyz);
    float usual_radius = texelFetch(usual, coarse_cell(to_pixel(center))).r / scale_at(-center.z);
#if LANES == 1
#if FROM_KEPT
    if (!take_kept(row, place)) {
        next[n] = max(first_ball(row, usual_radius), LEAST);
        return;
    }
    Extent extent = extent_of(UNKNOWN, usual_radius * unit);
#else
    Extent extent = search(place, again ? next[n] : first_ball(row, usual_radius), usual_radius, 0);
#endif
#else
    int lane = int(gl_LocalInvocationIndex);
    float radius = next[n];
    Extent extent;
    do {
        extent = search(place, radius, usual_radius, lane);
        radius = wider(extent);
    } while (extent.search > 0.0);
    if (lane > 0) return;
#endif
#if KEEPS && !FROM_KEPT
    keep(row, known);
#endif
    float across = fit(n, row, place, usual_radius, extent);
    next[n] = extent.search > 0.0 ? wider(extent) : -across;
}
