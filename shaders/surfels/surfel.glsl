// A surfel's template quad, T(p) S(r, r, 1) R(u, v, n) (Slomp 2014, V-A); of an ellipse, S(r_u, r_v, 1).
#include "surfels/splat.glsl"

vec3 surfel_u, surfel_v;  // half edges, view space
vec3 surfel_center;

bool begin_shape(Point point) {
    if (!has_splat(point)) return false;
    surfel_center = to_view(point.position);
    float depth = -surfel_center.z;
    vec3 to_eye = towards_eye(surfel_center);
    vec3 n = splat_normal(point, to_eye);
    if (cull_back && dot(mat3(world_to_view) * n, to_eye) <= 0.0) return false;

    // Out of view: not even the sphere around the splat's corners reaches the picture.
    float reach = 1.4142136 * splat_reach(point, depth);
    if (depth + reach < view_near) return false;
    if (depth > reach) {
        vec2 pixel = to_pixel(surfel_center);
        float margin = reach * scale_at(depth - reach) * (1.0 + length(surfel_center.xy) / depth) + 1.0;
        if (any(lessThan(pixel, vec2(-margin))) || any(greaterThan(pixel, vec2(view_size) + margin))) return false;
    }

    vec3 u, v;
    vec2 lengths = splat_axes(point, n, depth, u, v);
    surfel_u = mat3(world_to_view) * u * lengths.x;
    surfel_v = mat3(world_to_view) * v * lengths.y;
    return true;
}

Corner corner(int i) {
    vec2 local = vec2((i & 1) * 2 - 1, (i >> 1) * 2 - 1);
    return Corner(surfel_center + local.x * surfel_u + local.y * surfel_v, local);
}
