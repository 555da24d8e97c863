// A surfel's disc as the picture sees it: an ellipse, over which the reversed depth-buffer value
// changes linearly. The same cut-off and depth as the rasterised quad of surfels/surfel.glsl.
#include "surfels/splat.glsl"

uniform float mask_limit;  // squared distance from the centre at which the mask is cut off

vec3 disc_center, disc_normal;  // view space
float disc_area;                // squared radius at the cut-off

// False where it shows nothing: it faces away and such are left out, or it is thinner than a line.
bool begin_disc(Point point) {
    disc_center = to_view(point.position);
    float radius = splat_radius(point, -disc_center.z);
    disc_area = radius * radius * mask_limit;
    vec3 to_eye = towards_eye(disc_center);
    disc_normal = mat3(world_to_view) * splat_normal(point, to_eye);
    float facing = dot(disc_normal, to_eye);
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
vec3 disc_key(out vec3 form) {
    float depth = -disc_center.z;
    float pixel = 1.0 / scale_at(depth);
    vec3 n = disc_normal, right = vec3(pixel, 0.0, 0.0), down = vec3(0.0, -pixel, 0.0), key;
    if (view_perspective) {
        // 1 / depth of a plane is linear in pixels; so is a point of the plane over its depth.
        vec2 slope = vec2(n.x, -n.y) * pixel / dot(n, disc_center);
        key = view_near / depth * vec3(1.0, slope);
        right -= slope.x * disc_center;
        down -= slope.y * disc_center;
    } else {
        right.z = -right.x * n.x / n.z;
        down.z = -down.y * n.y / n.z;
        key = vec3(view_reach - depth, right.z, down.z) / (view_reach - view_near);
    }
    form = vec3(dot(right, right), dot(right, down), dot(down, down)) / disc_area;
    if (view_perspective) form *= key.x * key.x;
    return key;
}

// Pixel coordinates that hold the disc: lowest, highest. In perspective these are the tangents to
// the disc's image (its dual conic), off the centre.
vec4 disc_box() {
    float area = disc_area, depth = -disc_center.z;
    vec3 n = disc_normal;
    vec2 middle = vec2(0.0), reach;
    if (view_perspective) {
        vec2 at = disc_center.xy / depth;
        vec2 lean = n.xy + at * n.z;
        float divisor = area * (1.0 - n.z * n.z) - depth * depth;
        middle = area * (lean * n.z - at) / divisor;
        reach = sqrt(max(middle * middle - area * (1.0 + at * at - lean * lean) / divisor, 0.0));
    } else {
        reach = sqrt(max(area * (1.0 - n.xy * n.xy), 0.0));
    }
    middle *= vec2(view_scale, -view_scale);
    reach = reach * view_scale + 0.01;  // rounding
    return to_pixel(disc_center).xyxy + vec4(middle - reach, middle + reach);
}
