// Lists the sectors that may lie inside the object's outline: those of cells that a point falls into. The others
// are not propagated to. Each invocation looks at a run of sectors, so that the counter is touched once a run.
#include "common/item.glsl"
#include "common/list.glsl"
#include "hpr/sectors.glsl"

uniform int cell_shift;
layout(binding = TEXTURE_OCCUPIED) uniform usamplerBuffer occupied;
layout(std430, binding = STORAGE_STAMPS) buffer Stamps { uint stamps[]; };

const int RUN = 8;

bool is_inside(int sector) {
    ivec3 place = place_of(uint(sector));
    int cells = ((edge - 1) >> cell_shift) + 1;
    ivec2 cell = place.xy >> cell_shift;
    return texelFetch(occupied, (place.z * cells + cell.y) * cells + cell.x).r != 0u;
}

void main() {
    int first = int(item()) * RUN, last = min(first + RUN, int(sector_count()));
    uint found = 0u, bits = 0u;
    for (int i = first; i < last; ++i) {
        bool inside = is_inside(i);
        stamps[i] = inside ? 0u : NOTHING;
        bits |= uint(inside) << (i - first);
        found += uint(inside);
    }
    if (found == 0u) return;
    uint slot = reserve(found);
    for (int i = first; i < last; ++i)
        if ((bits >> (i - first) & 1u) != 0u) list[slot++] = uint(i);
}
