// The normal of each pixel that is listed: that of the splat which it shows.
#include "common/item.glsl"
#include "common/list.glsl"
#include "amplify/packed.glsl"

layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
layout(binding = TEXTURE_SPLATS) uniform usamplerBuffer splats;
layout(std430, binding = STORAGE_NORMAL) writeonly buffer Normal { float own_normals[]; };

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint pixel = list[i];
    vec3 normal = packed_normal(texelFetch(splats, int(texelFetch(rows, int(pixel)).r)).xyz);
    for (uint k = 0u; k < 3u; ++k) own_normals[3u * pixel + k] = normal[k];
}
