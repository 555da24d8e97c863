// A number of each point whose neighborhood was searched, by its row. NUMBER: which, in the order of VALUES in
// viewer/backends/auto_splats/values.py.
#include "common/item.glsl"

layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn;
layout(binding = TEXTURE_FOUND) uniform samplerBuffer found;  // as Neighborhoods has them
layout(std430, binding = STORAGE_VALUE) writeonly buffer Value { float values[]; };
#if NUMBER == 2
layout(binding = TEXTURE_SPLATS) uniform usamplerBuffer splats;
uniform float radius_scale;
#endif

void main() {
    uint i = item();
    if (i >= item_count) return;
    vec4 of_point = texelFetch(found, int(i));
#if NUMBER == 0
    float number = of_point.x;
#elif NUMBER == 1
    float number = of_point.z;
#elif NUMBER == 2
    float number = uintBitsToFloat(texelFetch(splats, int(texelFetch(drawn, int(i)).r)).y) * radius_scale;
#else
    float number = float(of_point.y < 0.0);
#endif
    values[texelFetch(drawn, int(i)).r] = number;
}
