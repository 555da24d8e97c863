// The camera (viewer/gpu/view.py), and from space to pixels and back.
#include <view>
#ifdef PERSPECTIVE  // a program for such views, or for orthographic ones, alone
#define view_perspective (PERSPECTIVE != 0)
#endif

// Several programs compute the same point's depth and pixel, and compare: without `precise`
// each compiler run may contract or reorder as it likes, and they differ in the last bit. It does not reach into the
// functions that are called, so that each has its own.
vec3 to_view(vec3 position) {
    precise vec3 view = world_to_view[0].xyz * position.x + world_to_view[1].xyz * position.y;
    view = view + world_to_view[2].xyz * position.z;
    view = view + world_to_view[3].xyz;
    return view;
}

// Pixels per scan unit at this depth.
float scale_at(float depth) {
    precise float scale = view_perspective ? view_scale / depth : view_scale;
    return scale;
}

// Pixel coordinates of a point in view space; row 0 is the top.
vec2 to_pixel(vec3 view) {
    precise float scale = view_perspective ? view_scale / -view.z : view_scale;
    precise vec2 pixel = vec2(view.x, -view.y) * scale;
    pixel = pixel + view_center;
    return pixel;
}

// View-space position of a pixel coordinate at a depth.
vec3 from_pixel(vec2 pixel, float depth) {
    precise vec2 offset = (pixel - view_center) / scale_at(depth);
    return vec3(offset.x, -offset.y, -depth);
}

bool in_depth_range(float depth) {
    return depth >= view_near && depth <= view_far;
}

// The reversed depth-buffer value of a depth.
float stored_depth(float depth) {
    precise float stored = view_perspective ? view_near / depth : (view_reach - depth) / (view_reach - view_near);
    return stored;
}

// Clip coordinates with reversed depth: near 1, far 0.
vec4 to_clip(vec3 view) {
    vec2 half_size = 0.5 * vec2(view_size), shift = view_center / half_size - 1.0;
    float depth = -view.z;
    precise vec2 at = view.xy * view_scale / half_size + vec2(shift.x, -shift.y) * (view_perspective ? depth : 1.0);
    if (view_perspective) return vec4(at, view_near, depth);
    return vec4(at, stored_depth(depth), 1.0);
}

// The depth (scan units) that a reversed depth-buffer value stands for.
float linear_depth(float stored) {
    precise float depth = view_perspective ? view_near / stored : view_reach - stored * (view_reach - view_near);
    return depth;
}
