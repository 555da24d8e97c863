// Lists the points that may be visible, and marks the others: a point is not where it is so far behind its sector's
// candidate that no direction around shows it; and is where it lies in no sector, since nothing is known that hides it.
// SAMPLED: a list says which points there are. Each invocation looks at a run of points, so that the counter is
// touched once a run.
#include "common/item.glsl"
#include "common/list.glsl"
#include "hpr/drawn_row.glsl"
#include "hpr/sectors.glsl"

uniform uint point_count;
layout(std430, binding = STORAGE_VISIBLE) buffer Visible { uint visible[]; };
layout(binding = TEXTURE_HOMES) uniform usamplerBuffer homes;
layout(binding = TEXTURE_BEST) uniform usamplerBuffer rows;
layout(binding = TEXTURE_SPOTS) uniform samplerBuffer spots;

const int RUN = 8;
uniform int stride;
const float FARTHEST = 6.0;  // of strides, squared: behind more, hardly a point is visible

uint key_of_candidate(uint sector) {
    uint row = texelFetch(rows, int(sector)).r;
    return key_of(texelFetch(spots, int(row)).xyz, direction_of(sector));
}

void main() {
    uint first = item() * uint(RUN), found = 0u, bits = 0u;
    float reach = float(stride) * sector_size(), most = FARTHEST * weight * reach * reach;
    for (int n = 0; n < RUN; ++n) {
        uint i = first + uint(n);
        if (i >= point_count) break;
        uvec2 home = texelFetch(homes, int(i)).rg;
        bool near = home.x != NOTHING;
        if (near) near = key_from(home.y) - key_from(key_of_candidate(home.x)) <= most;
        uint row = drawn_row(i);
        visible[row] = uint(home.x == NOTHING && home.y == 0u);
        bits |= uint(near) << n;
        found += uint(near);
    }
    if (found == 0u) return;
    uint slot = reserve(found);
    for (int n = 0; n < RUN; ++n)
        if ((bits >> n & 1u) != 0u) list[slot++] = first + uint(n);
}
