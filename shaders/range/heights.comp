// The height of each sample of a view along an axis, as rows count samples.
#include "common/item.glsl"
#include "range/samples.glsl"

layout(std430, binding = STORAGE_RANGE_VALUES) writeonly buffer Values { float heights[]; };

uniform int number;  // of the view
uniform vec4 up;     // the axis in pod space, and the height of the pod
uniform uint first;  // sample that is made by this call

void main() {
    if (item() >= item_count) return;
    int i = int(first + item());
    RangeView view = range_view(number);
    ivec2 uv = ivec2(i % view.size.x, i / view.size.x);
    vec3 place = sample_place(view, 0, vec2(uv), sample_depth(sample_index(view, 0, uv)));
    heights[view.first_id + uint(i)] = dot(up.xyz, place) + up.w;
}
