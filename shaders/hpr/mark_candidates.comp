// Marks the points that are candidates of the listed sectors, and no others: those that are visible for the paper (Machado
// e Silva 2014, 5.4).
#include "common/item.glsl"
#include "common/list.glsl"

layout(binding = TEXTURE_BEST) uniform usamplerBuffer rows;
layout(std430, binding = STORAGE_VISIBLE) buffer Visible { uint visible[]; };

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint row = texelFetch(rows, int(list[i])).r;
    if (row != NOTHING) visible[row] = 1u;
}
