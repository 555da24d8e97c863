// Two grids over the picture and a margin round it: fine cells, in which participants are listed, and coarse
// ones, for what is known of a region (backends/auto_splats/grids.py).
#include "common/view.glsl"
#include <params>

// Where a point is in the picture or the margin; false where it is in neither.
bool find_pixel(vec3 view, out vec2 pixel) {
    pixel = to_pixel(view);
    return in_depth_range(-view.z) && all(greaterThanEqual(pixel, vec2(-margin)))
        && all(lessThan(pixel, vec2(view_size + margin)));
}

bool in_picture(vec2 pixel) {
    return all(greaterThanEqual(pixel, vec2(0.0))) && all(lessThan(pixel, vec2(view_size)));
}

int pixel_number(vec2 pixel) { return int(pixel.y) * view_size.x + int(pixel.x); }

ivec2 fine_cell(vec2 pixel) { return (ivec2(floor(pixel)) + margin) >> fine_shift; }

int coarse_cell(vec2 pixel) {
    ivec2 cell = (ivec2(floor(pixel)) + margin) >> coarse_shift;
    return cell.y * coarse_size.x + cell.x;
}
