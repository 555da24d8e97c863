// A voxel's cells are the pixels whose rays meet its cube, its key is the depth there. For voxels of a few
// pixels: an invocation goes over all that a cube reaches.
#include "amplify/texels.glsl"
#include "voxels/voxel.glsl"

// Depth at which the ray through a pixel coordinate enters a cube; negative where it misses it.
float entry_depth(vec2 pixel, vec3 center, float half_length) {
    vec3 from = view_perspective ? vec3(0.0) : from_pixel(pixel, 0.0);
    vec3 direction = view_perspective ? from_pixel(pixel, 1.0) : vec3(0.0, 0.0, -1.0);
    mat3 axes = transpose(mat3(world_to_view));
    // Two programs compare depths of the same cube: `precise`, as in common/view.glsl.
    precise vec3 offset = axes * (center - from), along = axes * direction;
    along = mix(along, vec3(1e-12), lessThan(abs(along), vec3(1e-12)));
    precise vec3 one = (offset - half_length) / along, other = (offset + half_length) / along;
    precise vec3 enter = min(one, other), leave = max(one, other);
    precise float first = max(max(enter.x, enter.y), enter.z), last = min(min(leave.x, leave.y), leave.z);
    return first <= last ? first : -1.0;
}

void scatter(uint i) {
    Point point = texel_point(drawn_row(int(i)));
    vec3 center = to_view(point.position);
    float half_length = half_edge(point, -center.z);
    vec3 reach = cube_reach(half_length);
    if (-center.z + reach.z < view_near) return;
    ivec4 pixels = ivec4(clamp(ceil(cube_box(center, reach) - 0.5), vec4(0.0), vec2(view_size).xyxy));
    for (int y = pixels.y; y < pixels.w; ++y)
        for (int x = pixels.x; x < pixels.z; ++x) {
            float depth = entry_depth(vec2(x, y) + 0.5, center, half_length);
            if (in_depth_range(depth)) visit(uint(y * view_size.x + x), floatBitsToUint(depth), point.row);
        }
}
