// A splat's cells are the pixels whose centres its disc holds, its key is its depth there. For splats of
// about a pixel: an invocation goes over all that a disc holds.
#include "amplify/texels.glsl"
#include "surfels/disc.glsl"

void scatter(uint i) {
    Point point = texel_point(drawn_row(int(i)));
    if (!begin_disc(point)) return;
    vec2 depths = disc_range();
    if (depths.y < view_near || depths.x > view_far) return;
    ivec4 pixels = ivec4(clamp(ceil(disc_box() - 0.5), vec4(0.0), vec2(view_size).xyxy));
    vec2 center = to_pixel(disc_center);
    vec3 form, key = disc_key(form);
    for (int y = pixels.y; y < pixels.w; ++y)
        for (int x = pixels.x; x < pixels.z; ++x) {
            vec2 off = vec2(x, y) + 0.5 - center;
            precise float here = key.x + (key.y * off.x + key.z * off.y);
            float edge = view_perspective ? here * here : 1.0;
            if (form.x * off.x * off.x + off.y * (2.0 * form.y * off.x + form.z * off.y) > edge) continue;
            float depth = linear_depth(here);
            if (in_depth_range(depth)) visit(uint(y * view_size.x + x), floatBitsToUint(depth), point.row);
        }
}
