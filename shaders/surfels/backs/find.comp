// Lists the splats that face away whose centre is seen between those that face the eye.
#include "surfels/backs/backs.glsl"
#include "surfels/backs/shown.glsl"
#include "common/item.glsl"
#include "common/list.glsl"

void main() {
    uint i = item();
    if (i >= item_count) return;
    vec3 place;
    if (is_back(i, place) && shown_at(place.xy) > place.z * (1.0 + 1e-5)) list[reserve(1u)] = i;
}
