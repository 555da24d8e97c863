// Four neighbouring samples, and the triangles between those of one surface (Farooq 2013, 8.6.1).
#include "common/view.glsl"
#include "common/triangle.glsl"
#include "range/samples.glsl"

// A sample in the picture. there: whether it is one, and between near and far.
struct Corner {
    bool there;
    float depth;  // of its view's kind
    vec3 place;   // screen view space
    vec2 pixel;
    int index;
};

Corner corner_at(RangeView v, RangeLevel found, int level, ivec2 uv) {
    Corner corner;
    corner.there = all(greaterThanEqual(uv, ivec2(0))) && all(lessThan(uv, found.size));
    corner.index = sample_index(found, corner.there ? uv : ivec2(0));
    corner.there = corner.there && is_sample(corner.index);
    corner.depth = sample_depth(corner.index);
    corner.place = to_screen_view(v, sample_place(v, level, vec2(uv), corner.depth));
    corner.there = corner.there && in_depth_range(-corner.place.z);
    corner.pixel = to_pixel(corner.place);
    corner.there = corner.there && all(lessThan(abs(corner.pixel), vec2(1e6)));
    return corner;
}

// Whether the surface around a sample faces away from the eye.
bool shows_back(RangeView v, int level, ivec2 uv, Corner a) {
    return dot(sample_normal(v, level, uv), view_perspective ? a.place : vec3(0.0, 0.0, -1.0)) > 0.0;
}

// Corners of a quad: 0 at (u, v), 1 to the right, 2 below, 3 below to the right. A triangle goes by the corner that it
// lacks. A pixel shows an item: a triangle of the quad that a sample is the first corner of, or that sample alone.
const uint ALONE = 4u, PARTS = 8u;

uint item_of(int index, uint part) { return PARTS * uint(index) + part; }

bool joined(RangeView v, int level, Corner a, Corner b) {
    return a.there && b.there && same_surface(v, level, a.depth, b.depth);
}

// The triangles of a quad that are surface, a bit each: two, on either side of the flatter diagonal; one where a corner
// is missing, or lies on another surface.
int triangles(RangeView v, int level, Corner a, Corner b, Corner c, Corner d) {
    bool ab = joined(v, level, a, b), ac = joined(v, level, a, c), bd = joined(v, level, b, d);
    bool cd = joined(v, level, c, d), ad = joined(v, level, a, d), bc = joined(v, level, b, c);
    int whole = int(bc && bd && cd) | int(ac && ad && cd) << 1 | int(ab && ad && bd) << 2 | int(ab && ac && bc) << 3;
    if (whole != 15) return whole;
    return abs(a.depth - d.depth) <= abs(b.depth - c.depth) ? 6 : 9;
}

vec3 shares_at(Corner x, Corner y, Corner z, vec2 pixel) { return shares_at(x.pixel, y.pixel, z.pixel, pixel); }

vec3 depths_of(Corner x, Corner y, Corner z) { return -vec3(x.place.z, y.place.z, z.place.z); }
