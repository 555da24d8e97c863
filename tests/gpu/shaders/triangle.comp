// Depths of a triangle at pixels that were given.
#include "common/item.glsl"
const bool view_perspective = PERSPECTIVE != 0;
#include "common/triangle.glsl"

layout(std430, binding = 0) readonly buffer Corners { vec4 corners[3]; };  // pixel coordinates and depth
layout(std430, binding = 1) readonly buffer Pixels { vec2 pixels[]; };
layout(std430, binding = 2) writeonly buffer Depths { float depths[]; };

void main() {
    uint i = item();
    if (i >= item_count) return;
    vec3 shares = shares_at(corners[0].xy, corners[1].xy, corners[2].xy, pixels[i]);
    depths[i] = depth_at(vec3(corners[0].z, corners[1].z, corners[2].z), shares);
}
