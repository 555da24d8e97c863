// Points in the order of chunks, as amplify/texels.glsl reads them.
#include "common/item.glsl"
#include "chunks/point.glsl"

layout(std430, binding = STORAGE_ARRANGED) writeonly buffer Arranged { uvec4 arranged[]; };

void main() {
    uint place = item();
    if (place >= item_count) return;
    Point point = point_at(place);
    uint at = place * uint(2 + HAS_AXES + HAS_CELLS);
    arranged[at] = floatBitsToUint(vec4(point.position, point.radius));
    arranged[at + 1u] = uvec4(floatBitsToUint(point.normal), point.row);
#if HAS_AXES
    arranged[at + 2u] = floatBitsToUint(point.axes);
#endif
#if HAS_CELLS
    arranged[at + 3u] = floatBitsToUint(point.cell);
#endif
}
