// The k nearest participants of each listed one in space, and the splat through them (Preiner 2012, 5 and 6).
//
// Cells are searched that the image of a ball may reach. What they do not hold is behind one of the four
// planes through the eye and their outline, so that all within the distance to the nearest of these is
// known. Where k are not known yet, a larger ball follows. Distances are between places as stored, so that
// they do not depend on the view.
#include "common/item.glsl"
#if ROUND > 0
#include "common/list.glsl"
#endif
#include "auto_splats/place.glsl"
#include "auto_splats/k_nearest.glsl"
#include "auto_splats/fit.glsl"

layout(binding = TEXTURE_SLOTS) uniform usamplerBuffer slots;  // place, row
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;  // slots of those that are searched
layout(std430, binding = STORAGE_NEXT) buffer Next { float next[]; };  // radius of the next ball; 0: done
layout(binding = TEXTURE_STARTS) uniform usamplerBuffer starts;
layout(binding = TEXTURE_USUAL) uniform samplerBuffer usual;  // radius in each coarse cell, pixels
#if ROUND == 0
uniform uint first;
#endif

const float ROUNDING = 0.02;  // pixels that a point's cell may be off by, and more

vec3 center;  // view space

// Where tangent planes through the eye to a ball round the center cut the axis of pixels that `along` is the
// coordinate of.
vec2 tangents(float along, float radius, float middle) {
    if (!view_perspective) return middle + (along + vec2(-radius, radius)) * view_scale;
    float depth = -center.z, squared = depth * depth - radius * radius;
    if (squared <= 0.0) return vec2(-1e9, 1e9);
    vec2 slope = (along * depth + vec2(-radius, radius) * sqrt(along * along + squared)) / squared;
    return clamp(middle + slope * view_scale, -1e9, 1e9);
}

// The cells that a ball's image may reach: first and last.
ivec4 cells_of(float radius) {
    vec2 x = tangents(center.x, radius, 0.5 * view_size.x), y = tangents(-center.y, radius, 0.5 *
    view_size.y); vec4 box = vec4(x.x, y.x, x.y, y.y) + ROUNDING * vec4(-2.0, -2.0, 2.0, 2.0);
    return clamp(ivec4(floor(box)) + margin >> fine_shift, ivec4(0), fine_size.xyxy - 1);
}

// The distance from the center to the plane through the eye and a line of pixels.
float plane_distance(float along, float pixel) {
    float slope = pixel / view_scale;
    return view_perspective ? abs(along + slope * center.z) * inversesqrt(1.0 + slope * slope) : abs(along -
    slope);
}

// Of cells, the distance from the center within which they hold all participants.
float known_within(ivec4 cells) {
    vec4 edge = vec4((cells + ivec4(0, 0, 1, 1) << fine_shift) - margin) + ROUNDING * vec4(1.0, 1.0, -1.0,
    -1.0); edge -= 0.5 * vec2(view_size).xyxy;
    vec4 known = vec4(UNKNOWN);
    if (cells.x > 0) known.x = plane_distance(center.x, edge.x);
    if (cells.y > 0) known.y = plane_distance(-center.y, edge.y);
    if (cells.z < fine_size.x - 1) known.z = plane_distance(center.x, edge.z);
    if (cells.w < fine_size.y - 1) known.w = plane_distance(-center.y, edge.w);
    return min(min(known.x, known.y), min(known.z, known.w));
}

// The radius of the ball that is searched next, scan units, 0: none. A little wider: what it touches is
// within.
float wider(Extent extent) { return extent.search / unit * 1.0001; }

// The extent of the neighborhood as far as one search tells.
Extent search(vec3 place, float radius, float usual_radius) {
    ivec4 cells = cells_of(radius);
    clear_nearest();
    for (int y = cells.y; y <= cells.w; ++y) {
        int line = y * fine_size.x, last = int(texelFetch(starts, line + cells.z + 1).r);
        for (int i = int(texelFetch(starts, line + cells.x).r); i < last; ++i) {
            uvec4 other = texelFetch(slots, i);
            take(uintBitsToFloat(other.xyz) - place, other.w);
        }
    }
    float known = known_within(cells);
    return extent_of(known < UNKNOWN ? known * unit : UNKNOWN, usual_radius * unit);
}

#if ROUND == 0
// The radius that is searched first: as large as this row's neighborhood was in the last picture that it had
// one in, of whatever pose; else what most are within.
float first_ball(uint row, float usual_radius) {
    float before = extents[row];
    return usual_radius * (before > 0.0 ? clamp(before / usual_radius * 1.001, 0.3, 3.0) : FIRST_BALL);
}
#endif

void main() {
    uint i = item();
#if ROUND == 0
    if (i >= item_count) return;
    uint n = first + i;
#else
    if (i >= list_count) return;
    uint n = list[i];
#endif
    uvec4 slot = texelFetch(slots, int(texelFetch(listed, int(n)).r));
    vec3 place = uintBitsToFloat(slot.xyz);
    center = to_view(texelFetch(positions, int(slot.w)).xyz);
    float usual_radius = texelFetch(usual, coarse_cell(to_pixel(center))).r / scale_at(-center.z);
#if ROUND == 0
    Extent extent = search(place, first_ball(slot.w, usual_radius), usual_radius);
#else
    Extent extent = search(place, next[n], usual_radius);
#endif
#if ROUND == 2
    while (extent.search > 0.0) extent = search(place, wider(extent), usual_radius);
#endif
    next[n] = wider(extent);
    fit(n, slot.w, place, usual_radius, extent);
}
