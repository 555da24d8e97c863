// A surfel's template quad, T(p) S(r, r, 1) R(u, v, n) (Slomp 2014, V-A); of an ellipse, S(r_u, r_v, 1).
#include "surfels/splat.glsl"

// Feeds that give the same bits are programs of their own: `precise`, as in common/view.glsl.
precise vec3 surfel_u, surfel_v;  // half edges, view space
precise vec3 surfel_center;
vec4 surfel_part;  // lowest, highest local coordinates of what is drawn of the quad
#ifdef PUSHED
float surfel_push;  // how far away from the eye it is drawn, scan units
#endif

const float HUGE = 8.0;  // depths of the centre, or heights of the picture

// Of a quad far larger than the picture, what the picture's corners see of it: its own corners would be so far away
// that float32 resolves pixels there. All of it where the picture shows the plane's horizon.
vec4 part_in_picture() {
    vec3 n = cross(surfel_u, surfel_v);
    vec2 lowest = vec2(1.0), highest = vec2(-1.0);
    for (int i = 0; i < 4; ++i) {
        vec2 pixel = vec2(i & 1, i >> 1) * view_size;
        vec3 from = view_perspective ? vec3(0.0) : from_pixel(pixel, 0.0);
        vec3 along = view_perspective ? from_pixel(pixel, 1.0) : vec3(0.0, 0.0, -1.0);
        float t = dot(n, surfel_center - from) / dot(n, along);
        if (!(abs(t) < UNKNOWN) || (view_perspective && t <= 0.0)) return vec4(-1.0, -1.0, 1.0, 1.0);
        vec3 off = from + t * along - surfel_center;
        vec2 local = in_half_axes(off, surfel_u, surfel_v);
        lowest = min(lowest, local);
        highest = max(highest, local);
    }
    vec2 margin = 0.01 * (highest - lowest);
    return clamp(vec4(lowest - margin, highest + margin), -1.0, 1.0);
}

bool begin_shape(Point point) {
    if (!has_splat(point)) return false;
    surfel_center = to_view(point.position);
    float depth = -surfel_center.z;
    vec3 to_eye = towards_eye(surfel_center);
    vec3 n = splat_normal(point, to_eye);
    if (cull_back && dot(mat3(world_to_view) * n, to_eye) <= 0.0) return false;

    vec3 u, v;
    vec2 lengths = splat_axes(point, n, depth, u, v);
#ifdef PUSHED
    surfel_push = epsilon * max(lengths.x, lengths.y);
#endif
    surfel_u = mat3(world_to_view) * u * lengths.x;
    surfel_v = mat3(world_to_view) * v * lengths.y;
#if HAS_CELLS
    fit_to_cell(point, mat3(world_to_view) * n, surfel_center, surfel_u, surfel_v);
    depth = -surfel_center.z;
#endif

    // Out of view: not even the sphere around the splat's corners reaches the picture.
    float reach = 1.4142136 * splat_reach(point, depth);
    if (depth + reach < view_near) return false;
    if (depth > reach) {
        vec2 pixel = to_pixel(surfel_center);
        float margin = reach * scale_at(depth - reach) * (1.0 + length(surfel_center.xy) / depth) + 1.0;
        if (any(lessThan(pixel, vec2(-margin))) || any(greaterThan(pixel, vec2(view_size) + margin))) return false;
    }

    float usual = view_perspective ? depth : view_size.y / view_scale;
    surfel_part = reach > HUGE * usual ? part_in_picture() : vec4(-1.0, -1.0, 1.0, 1.0);
    return true;
}

Corner corner(int i) {
    vec2 local = vec2((i & 1) == 0 ? surfel_part.x : surfel_part.z, (i >> 1) == 0 ? surfel_part.y : surfel_part.w);
    precise vec3 view = surfel_center + local.x * surfel_u + local.y * surfel_v;
#ifdef PUSHED
    view -= surfel_push * normalize(towards_eye(view));
#endif
    return Corner(view, local);
}
