// Depths become those of the local surface, once no pass needs the nearest splat's any more. A pixel without one keeps its depth.
#include "common/view.glsl"
#include "common/item.glsl"

layout(std430, binding = STORAGE_DEPTHS) buffer Depths { uint depths[]; };
layout(std430, binding = STORAGE_LOCAL_DEPTHS) readonly buffer LocalDepths { uint local_depths[]; };

void main() {
    uint i = item();
    if (i >= uint(view_size.x * view_size.y)) return;
    if (depths[i] != NO_DEPTH && local_depths[i] != 0u) depths[i] = local_depths[i];
}
