// What a point's splat is, for quads and for discs alike: `precise`, as in common/view.glsl.
#include "common/view.glsl"
#include "common/tangent.glsl"
#include "amplify/point.glsl"
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
