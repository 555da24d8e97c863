// A voxel: an upright cube around a centre, `radius` being half of its edge (Slomp 2014, VI).
#include "common/view.glsl"
#include "amplify/point.glsl"

// Half of the edge, scan units. A cube of less can fall between pixel centres; the ball in one of this size cannot.
float half_edge(Point point, float depth) {
    return max(point.radius * enlarged, LEAST_RADIUS / scale_at(max(depth, view_near)));
}

// How far a cube reaches from its centre along the axes of the view.
vec3 cube_reach(float half_length) {
    mat3 axes = mat3(world_to_view);
    return half_length * (abs(axes[0]) + abs(axes[1]) + abs(axes[2]));
}

// Pixels that a cube may reach: lowest, highest coordinates. All of them where it reaches the eye's plane.
vec4 cube_box(vec3 center, vec3 reach) {
    float depth = -center.z;
    if (view_perspective && depth <= reach.z) return vec4(vec2(0.0), view_size);
    vec2 grown = reach.xy;
    if (view_perspective) grown = (reach.xy * depth + abs(center.xy) * reach.z) / (depth * (depth - reach.z));
    grown = grown * view_scale + 0.01;  // rounding
    return to_pixel(center).xyxy + vec4(-grown, grown);
}
