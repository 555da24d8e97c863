// What a point's splat is, for quads and for discs alike.
#include "common/view.glsl"
#include "amplify/point.glsl"

uniform float radius_scale;
uniform float uniform_radius;  // scan units, for points without one of their own
uniform bool cull_back;

// Scan units. Below the least one a splat can fall between pixel centres, and a far scan would flicker away.
float splat_radius(Point point, float depth) {
    float radius = point.radius > 0.0 && point.radius < 3e38 ? point.radius : uniform_radius;
    return max(radius * radius_scale * enlarged, 0.7072 / scale_at(max(depth, view_near)));
}

// From a splat's centre towards the eye, view space.
vec3 towards_eye(vec3 center) {
    return view_perspective ? -center : vec3(0.0, 0.0, 1.0);
}

// Unit length, from the origin's axes; a missing normal faces the eye.
vec3 splat_normal(Point point, vec3 to_eye) {
    float len = length(point.normal);
    return len > 0.0 && len < 3e38 ? point.normal / len : normalize(transpose(mat3(world_to_view)) * to_eye);
}
