// A splat's cells are the pixels whose centres its disc holds, its key is its depth there. SENT: of those discs alone that
// surfels/tiles/cells.glsl has sent to pixels already.
#include "amplify/texels.glsl"
#include "surfels/pixels.glsl"

#ifdef SENT
layout(binding = TEXTURE_REACH) uniform usamplerBuffer reach;
#endif

void take_pixel(uint pixel, uint depth, uint row) { visit(pixel, depth, row); }

void scatter(uint i) {
#ifdef SENT
    if (texelFetch(reach, int(i)).r != SENT) return;
#endif
    Point point = texel_point(drawn_row(int(i)));
    if (!begin_disc(point)) return;
    vec2 depths = disc_range();
    if (depths.y < view_near || depths.x > view_far) return;
    take_pixels(pixels_in(disc_box()), point.row);
}
