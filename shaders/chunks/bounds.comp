// What the splats of each chunk have in common: the box round their points; a cone round their normals, its middle and the
// cosine of how far any is off it, -1 where one is unknown; and the longest of the radii that are known,
// with how far the middle of a splat is off its point.
#include "common/item.glsl"
#include "chunks/point.glsl"
#include "surfels/cell.glsl"

layout(std430, binding = STORAGE_BOXES) writeonly buffer Boxes { float boxes[]; };  // lower corner, upper corner
layout(std430, binding = STORAGE_CONES) writeonly buffer Cones { vec4 cones[]; };
layout(std430, binding = STORAGE_REACHES) writeonly buffer Reaches { float reaches[]; };

uniform uint point_count;

bool is_known(float size) { return size > 0.0 && size < UNKNOWN; }

float reach_of(Point point) {
    float reach = point.radius;
#if HAS_AXES
    float longer = max(length(point.axes.xyz), point.axes.w);
    reach = longer > 0.0 ? longer : reach;
#endif
#if HAS_CELLS
    reach *= 1.0 + length(cell_offset(point.cell.x));
#endif
    return is_known(reach) ? reach : 0.0;
}

void main() {
    uint chunk = item(), first = chunk * uint(CHUNK), last = min(first + uint(CHUNK), point_count);
    if (chunk >= item_count) return;
    vec3 low = vec3(UNKNOWN), high = -low, sum = vec3(0.0);
    float reach = 0.0, least = 1.0;
    for (uint i = first; i < last; ++i) {
        Point point = point_at(i);
        float size = length(point.normal);
        if (is_known(size)) sum += point.normal / size;
        reach = max(reach, reach_of(point));
        low = min(low, point.position);
        high = max(high, point.position);
    }
    vec3 middle = dot(sum, sum) > 0.0 ? normalize(sum) : vec3(0.0, 0.0, 1.0);
    for (uint i = first; i < last; ++i) {
        vec3 normal = point_at(i).normal;
        float size = length(normal);
        least = min(least, is_known(size) ? dot(normal / size, middle) : -1.0);
    }
    for (uint k = 0u; k < 3u; ++k) {
        boxes[6u * chunk + k] = low[k];
        boxes[6u * chunk + 3u + k] = high[k];
    }
    cones[chunk] = vec4(middle, least);
    reaches[chunk] = reach;
}
