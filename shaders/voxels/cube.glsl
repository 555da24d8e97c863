// A voxel's template cube: the faces that look at the eye, three at most, as one strip.
#include "voxels/voxel.glsl"

vec3 cube_center, cube_u, cube_v, cube_w;  // view space; half edges, towards the eye

bool begin_shape(Point point) {
    cube_center = to_view(point.position);
    float depth = -cube_center.z, length_ = half_edge(point, depth);
    mat3 axes = mat3(world_to_view);
    vec3 to_eye = transpose(axes) * (view_perspective ? -cube_center : vec3(0.0, 0.0, 1.0));
    if (view_perspective && all(lessThan(abs(to_eye), vec3(length_)))) return false;  // the eye is inside

    vec3 reach = cube_reach(length_);
    if (depth + reach.z < view_near) return false;
    vec4 box = cube_box(cube_center, reach);
    if (any(lessThan(box.zw, vec2(0.0))) || any(greaterThan(box.xy, vec2(view_size)))) return false;
    vec3 signs = mix(vec3(-1.0), vec3(1.0), greaterThanEqual(to_eye, vec3(0.0))) * length_;
    cube_u = axes[0] * signs.x;
    cube_v = axes[1] * signs.y;
    cube_w = axes[2] * signs.z;
    return true;
}

// Bits: on the eye's side along x, y, z. Three faces around corner 7; the shortest strip there is, with one
// triangle that is a line.
const int STRIP[9] = int[9](4, 6, 5, 7, 1, 7, 3, 6, 2);

Corner corner(int i) {
    ivec3 side = (ivec3(STRIP[i]) >> ivec3(0, 1, 2) & 1) * 2 - 1;
    return Corner(cube_center + cube_u * side.x + cube_v * side.y + cube_w * side.z, vec2(0.0));
}
