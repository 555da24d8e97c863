// Marks the cells round the centres that are listed.
//
// At an outline a centre may be seen only since the surface bends away between two splats: such centres face away by
// little, and something that faces the eye is beside them, as near.
#include "surfels/backs/backs.glsl"
#include "surfels/backs/shown.glsl"
#include "common/item.glsl"
#include "common/list.glsl"

layout(std430, binding = STORAGE_MARKS) writeonly buffer Marks { uint marks[]; };

// Whether anything at about a depth faces the eye round a place. reach: pixels.
bool is_outline(vec2 place, float depth, float reach, float tolerance) {
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
            vec2 way = vec2(x, y) * (x * y == 0 ? 1.0 : 0.70710678);
            if (abs(shown_at(place + way * reach) - depth) <= tolerance) return true;
        }
    return false;
}

void main() {
    uint i = item();
    if (i >= list_count) return;
    Point point = texel_point(drawn_row(int(list[i])));
    vec3 center = to_view(point.position);
    vec2 place = to_pixel(center);
    float depth = -center.z, radius = splat_reach(point, depth), reach = max(radius * scale_at(depth), 1.0);
    vec2 outside = max(max(-place, place - vec2(view_size)), 0.0);
    if (max(outside.x, outside.y) > reach) return;
    if (facing_of(point, center) > LITTLE && is_outline(place, depth, reach, NEAR_BY * radius)) return;
    float margin = min(2.0 * reach + float(CELL), float(MOST_CELLS * CELL));
    ivec2 first = pixel_at(place - margin) / CELL, last = pixel_at(place + margin) / CELL;
    for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x) marks[y * cells.x + x] = 1u;
}
