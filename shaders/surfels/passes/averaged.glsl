// What a splat of about a pixel gives to the means of pixels: one of each that lies at most so far behind what its
// pixel shows. All count the same: a mask's shape cannot be seen.
#include "common/view.glsl"
#include "surfels/passes/limit.glsl"
#include "surfels/passes/look.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;

void visit(uint cell, uint key, uint item_id) {
    uint row = texelFetch(rows, int(cell)).r;
    if (row == NOTHING) return;  // two programs round apart at a splat's border
    float depth = uintBitsToFloat(texelFetch(depths, int(cell)).r);
    if (uintBitsToFloat(key) > depth + epsilon * visible_radius(depth, row)) return;
    uvec2 look = texelFetch(looks, int(item_id)).xy, shown = texelFetch(looks, int(row)).xy;
    vec3 n = normal_of(look);
    n *= turned(1.0, n, normal_of(shown));
#if HAS_COLORS
    vec3 light = light_of(look);
    add(cell, float[](1.0, n.x, n.y, n.z, light.r, light.g, light.b));
#else
    add(cell, float[](1.0, n.x, n.y, n.z));
#endif
}

#include "surfels/scatter.glsl"
