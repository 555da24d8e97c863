// A number of each point whose neighborhood was searched, by its row. NUMBER: which, in the order of VALUES in
// viewer/backends/auto_splats/values.py.
#include "common/item.glsl"

layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn;
layout(binding = TEXTURE_FOUND) uniform samplerBuffer found;  // radius, number of points, negative of an outlier, curvature
layout(binding = TEXTURE_SPLATS) uniform usamplerBuffer splats;
layout(std430, binding = STORAGE_VALUE) writeonly buffer Value { float values[]; };
uniform float radius_scale;

void main() {
    uint i = item();
    if (i >= item_count) return;
    int row = int(texelFetch(drawn, int(i)).r);
    vec4 of_point = texelFetch(found, int(i));
#if NUMBER == 0
    float number = of_point.x;
#elif NUMBER == 1
    float number = of_point.z;
#elif NUMBER == 2
    float number = uintBitsToFloat(texelFetch(splats, row).y) * radius_scale;
#else
    float number = float(of_point.y < 0.0);
#endif
    values[row] = number;
}
