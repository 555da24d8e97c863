// How near each coarse cell sees anything, and how many see any.
#include "common/item.glsl"
#include "common/split.glsl"
#include "common/list.glsl"
#include "auto_splats/place.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(std430, binding = STORAGE_KEYS) buffer Nearest { uint nearest[]; };  // depth bits; NO_DEPTH: nothing
layout(std430, binding = STORAGE_TOTALS) buffer Totals { uint occupied; };

void main() {
    uint n = item();
    if (n >= list_count) return;
    int i = int(list[n]);
    uint before = atomicMin(nearest[coarse_cell(vec2(split(i, view_size.x)) + 0.5)], texelFetch(depths, i).r);
    if (before == NO_DEPTH) atomicAdd(occupied, 1u);
}
