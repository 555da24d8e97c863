// A surfel's disc as the picture sees it: an ellipse, over which the reversed depth-buffer value
// changes linearly, so that no pixel needs a division. Numbers are relative to the disc's own centre. The same cut-off
// and depth as the rasterised quad of surfels/surfel.glsl.
#include "surfels/splat.glsl"

// Two programs of surfels/scatter.glsl compare depths of the same disc: `precise`, as in common/view.glsl.
precise vec3 disc_center, disc_normal;  // view space
precise float disc_area;                // squared radius at the cut-off; of an ellipse, squared longer half-axis
#if HAS_AXES
precise vec3 disc_u, disc_v;  // conjugate half-axes at the cut-off, view space
#endif

// False where it shows nothing: it faces away and such are left out, or it is thinner than a line.
bool begin_disc(Point point) {
    if (!has_splat(point)) return false;
    disc_center = to_view(point.position);
    precise float radius = splat_reach(point, -disc_center.z);
    disc_area = radius * radius * mask_limit;
    vec3 to_eye = towards_eye(disc_center);
    precise vec3 n = splat_normal(point, to_eye);
    disc_normal = mat3(world_to_view) * n;
#if HAS_AXES
    vec3 u, v;
    precise float cut_off = sqrt(mask_limit);
    precise vec2 lengths = splat_axes(point, n, -disc_center.z, u, v);
#if !HAS_CELLS
    lengths *= cut_off;
#endif
    disc_u = mat3(world_to_view) * u * lengths.x;
    disc_v = mat3(world_to_view) * v * lengths.y;
#if HAS_CELLS
    fit_to_cell(point, disc_normal, disc_center, disc_u, disc_v);
    disc_u *= cut_off;
    disc_v *= cut_off;
#endif
#endif
    precise float facing = dot(disc_normal, to_eye);
    if (cull_back && facing <= 0.0) return false;
    return abs(facing) > 1e-6 * length(to_eye);
}

// The nearest and the farthest that it may reach, along the view axis.
vec2 disc_range() {
    return -disc_center.z + sqrt(disc_area) * vec2(-1.0, 1.0);
}

// (key at the centre; its change a pixel right and down), a reversed depth-buffer value.
// form: a, b, c; a pixel (x, y) off the centre is inside where a x^2 + 2 b x y + c y^2 <= key^2 in
// perspective, <= 1 in orthographic views.
vec3 disc_key(out precise vec3 form) {
    float depth = -disc_center.z;
    precise float pixel = 1.0 / scale_at(depth);
    precise vec3 n = disc_normal, right = vec3(pixel, 0.0, 0.0), down = vec3(0.0, -pixel, 0.0), key;
    if (view_perspective) {
        // 1 / depth of a plane is linear in pixels; so is a point of the plane over its depth.
        precise vec2 slope = vec2(n.x, -n.y) * pixel / dot(n, disc_center);
        key = view_near / depth * vec3(1.0, slope);
        right -= slope.x * disc_center;
        down -= slope.y * disc_center;
    } else {
        right.z = -right.x * n.x / n.z;
        down.z = -down.y * n.y / n.z;
        key = vec3(view_reach - depth, right.z, down.z) / (view_reach - view_near);
    }
#if HAS_AXES
    precise vec2 x = in_half_axes(right, disc_u, disc_v), y = in_half_axes(down, disc_u, disc_v);
    form = vec3(dot(x, x), dot(x, y), dot(y, y));
#else
    form = vec3(dot(right, right), dot(right, down), dot(down, down)) / disc_area;
#endif
    if (view_perspective) form *= key.x * key.x;
    return key;
}

// Pixel coordinates that hold the disc: lowest, highest. In perspective these are the tangents to
// the disc's image (its dual conic c c^T - E), off the centre. E: the half-axes' sum of u u^T.
vec4 disc_box() {
#if HAS_AXES
    vec3 squares = disc_u * disc_u + disc_v * disc_v;  // E's diagonal
    vec2 leaning = disc_u.xy * disc_u.z + disc_v.xy * disc_v.z;  // E_xz, E_yz
#else
    vec3 n = disc_normal, squares = disc_area * (1.0 - n * n);
    vec2 leaning = -disc_area * n.xy * n.z;
#endif
    float depth = -disc_center.z;
    vec2 middle = vec2(0.0), area = squares.xy;
    if (view_perspective) {
        vec2 at = disc_center.xy / depth;
        float divisor = depth * depth - squares.z;
        middle = (leaning + at * squares.z) / divisor;
        area = middle * middle + (squares.xy + at * (2.0 * leaning + at * squares.z)) / divisor;
    }
    vec2 reach = sqrt(max(area, 0.0));
    middle *= vec2(view_scale, -view_scale);
    reach = reach * view_scale + 0.01;  // rounding
    return to_pixel(disc_center).xyxy + vec4(middle - reach, middle + reach);
}
