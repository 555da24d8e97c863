// Leaves out the splats that face away whose centre is in no cell that is marked. In tiles the others stay among those
// that face away; else they get normals that face the eye, so that leaving out what faces away leaves them.
#include "surfels/backs/backs.glsl"
#include "common/item.glsl"

layout(binding = TEXTURE_MARKS) uniform usamplerBuffer marks;
#if TILED
layout(std430, binding = STORAGE_AWAY) writeonly buffer Away { uint kept_depths[]; };
#else
layout(std430, binding = STORAGE_TURNED) writeonly buffer Turned { float turned[]; };
#endif

void main() {
    uint i = item();
    if (i >= item_count) return;
    vec3 place;
    bool faces_away = is_back(i, place);
    ivec2 cell = pixel_at(place.xy) / CELL;
    bool is_marked = texelFetch(marks, cell.y * cells.x + cell.x).r != 0u;
#if TILED
    if (faces_away && !is_marked) kept_depths[i] = 0u;
#else
    Point point = texel_point(drawn_row(int(i)));
    vec3 normal = faces_away && is_marked ? -point.normal : point.normal;
    for (uint k = 0u; k < 3u; ++k) turned[3u * point.row + k] = normal[k];
#endif
}
