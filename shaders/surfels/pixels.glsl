// The pixels whose centres a disc holds: for discs of a few pixels, an invocation goes over all of them.
#include "surfels/disc.glsl"

// What becomes of each pixel: its number, the disc's depth there as float bits, the point's row.
void take_pixel(uint pixel, uint depth, uint row);

// The pixels whose centres the box of a disc holds: first, and the one after the last.
ivec4 pixels_in(vec4 box) { return ivec4(clamp(ceil(box - 0.5), vec4(0.0), vec2(view_size).xyxy)); }

// pixels: as `pixels_in` has them of the disc that was begun.
void take_pixels(ivec4 pixels, uint row) {
    vec2 center = to_pixel(disc_center);
    precise vec3 form, key = disc_key(form);
    for (int y = pixels.y; y < pixels.w; ++y)
        for (int x = pixels.x; x < pixels.z; ++x) {
            vec2 off = vec2(x, y) + 0.5 - center;
            // The same numbers as surfels/tiles/nearest.glsl finds, where other discs of the picture are drawn so.
            precise float column = key.x + key.y * off.x, here = column + key.z * off.y;
            precise float shape = form.x * off.x * off.x;
            shape += off.y * (2.0 * form.y * off.x + form.z * off.y);
            precise float edge = view_perspective ? here * here : 1.0;
            if (shape > edge) continue;
            float depth = linear_depth(here);
            if (in_depth_range(depth)) take_pixel(uint(y * view_size.x + x), floatBitsToUint(depth), row);
        }
}
