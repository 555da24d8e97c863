// What a point's splat is, for quads and for discs alike: `precise`, as in common/view.glsl.
#include "common/view.glsl"
#include "common/tangent.glsl"
#include "amplify/point.glsl"
#include "surfels/cell.glsl"
// splatting/splats.py.
#include <params>

// Scan units. Below the least one a splat can fall between pixel centres, and a far scan would flicker away.
float splat_radius(float stored, float depth) {
    float radius = uniform_radius;
    radius = stored > 0.0 && stored < UNKNOWN ? stored : radius;
    precise float reach = max(radius * radius_scale * enlarged, least_radius / scale_at(max(depth, view_near)));
    return reach;
}

// Points of which a compute pass made no splat have a radius of 0.
bool has_splat(Point point) {
#if PACKED
    return point.radius > 0.0;
#else
    return true;
#endif
}

// From a splat's centre towards the eye, view space.
vec3 towards_eye(vec3 center) {
    return view_perspective ? -center : vec3(0.0, 0.0, 1.0);
}

// Unit length, from the origin's axes; a missing normal faces the eye.
vec3 splat_normal(Point point, vec3 to_eye) {
    precise float len = length(point.normal);
    bool has_normal = len > 0.0 && len < UNKNOWN;
    precise vec3 n = has_normal ? point.normal / len : normalize(transpose(mat3(world_to_view)) * to_eye);
    return n;
}

// The longer of its half-axes, scan units.
float splat_reach(Point point, float depth) {
#if HAS_AXES
    precise float longer = max(length(point.axes.xyz), point.axes.w);
    if (longer > 0.0) return splat_radius(longer, depth);
#endif
    return splat_radius(point.radius, depth);
}

// The directions of its half-axes, unit vectors perpendicular to the normal n, from the origin's axes; returns
// their lengths, scan units. A tangent that is missing, or parallel to the normal, makes it round.
vec2 splat_axes(Point point, vec3 n, float depth, out precise vec3 u, out precise vec3 v) {
    precise vec2 lengths = vec2(splat_radius(point.radius, depth));
    u = tangent_of(n);
#if HAS_AXES
    precise float first = length(point.axes.xyz);
    precise vec3 tangent = first > 0.0 ? point.axes.xyz / first : n;
    tangent -= dot(tangent, n) * n;
    if (dot(tangent, tangent) > 1e-6) {
        u = normalize(tangent);
        lengths = vec2(splat_radius(first, depth), splat_radius(point.axes.w, depth));
    }
#endif
    v = cross(n, u);  // the paper prints n x a, which is -u
    return lengths;
}

#if HAS_CELLS
const float LEAST_SHARE = 0.15;  // of a splat's width that a neighbour's plane leaves
const float GRAZING = 0.1;  // cosine between a normal and the line of sight; below, a plane is seen from the side

// Move the middle of a splat from its point to that of its cell, and draw the splat in where the plane of a neighbour ends
// the surface: where it is seen from the side, or shows the other side than the splat, the splat would stick out of the
// outline. The side towards the neighbour moves to the plane, and the opposite side stays. All in view space. n: normal
// of the splat; u, v: half-axes, conjugate ones afterwards.
void fit_to_cell(Point point, vec3 n, inout precise vec3 center, inout precise vec3 u, inout precise vec3 v) {
    precise vec3 from = center;
    float depth = -center.z, least = least_radius / scale_at(max(depth, view_near));
    float longer = max(length(u), length(v));
    precise vec3 along = normalize(u), across = normalize(v);
    float shown = dot(n, towards_eye(from)) > 0.0 ? 1.0 : -1.0;
    vec2 offset = cell_offset(point.cell.x);
    center += offset.x * u + offset.y * v;
    for (int k = 0; k < CELL_PLANES; ++k) {
        float code = point.cell[k + 1];
        vec3 plane = cell_plane(code);
        precise vec3 to = cos(plane.x) * along + sin(plane.x) * across;
        precise float end = plane.z * longer;
        vec3 neighbor = cos(plane.y) * n + sin(plane.y) * to;
        bool ends = code > 0.0 && shown * dot(neighbor, normalize(towards_eye(from + end * to))) < GRAZING;
        precise vec2 parts = vec2(dot(u, to), dot(v, to));
        precise float half_width = max(length(parts), 1e-30);
        precise float share = (end - dot(center - from, to)) / (2.0 * half_width) + 0.5;
        share = ends ? clamp(share, min(max(LEAST_SHARE, least / half_width), 1.0), 1.0) : 1.0;
        precise vec3 side = (share - 1.0) * (parts.x * u + parts.y * v) / half_width;
        center += side;
        u += side * (parts.x / half_width);
        v += side * (parts.y / half_width);
    }
}
#endif

// A vector of a splat's plane in its half-axes u and v.
vec2 in_half_axes(vec3 offset, vec3 u, vec3 v) {
    precise vec2 local, squares = vec2(dot(u, u), dot(v, v)), parts = vec2(dot(offset, u), dot(offset, v));
#if HAS_CELLS
    precise float mixed = dot(u, v), divisor = squares.x * squares.y - mixed * mixed;
    local = (squares.yx * parts - mixed * parts.yx) / divisor;
#else
    local = parts / squares;
#endif
    return local;
}
