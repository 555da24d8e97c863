// Both passes of splats as Slomp 2014 has them (V-B). SHADES 0: their depths alone; 1: their colours, which the feed
// brought, transparent as their masks.
#include "common/view.glsl"
#include "common/color.glsl"
#include <params>

flat in uint row;
flat in vec3 color;
in vec2 local;

layout(location = 0) out vec4 out_light;  // and weight
layout(location = 1) out vec4 out_depth;  // times the weight

void main() {
    float t = dot(local, local);
    if (t > mask_limit) discard;
#if SHADES
    float weight = exp(-falloff * t / mask_limit);
    out_light = weight * vec4(to_linear(color), 1.0);
    out_depth = vec4(weight * linear_depth(gl_FragCoord.z));
#endif
}
