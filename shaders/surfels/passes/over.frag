// A splat over what was drawn before it: light and normal, transparent as its mask says.
#include "common/view.glsl"
#include "surfels/passes/visible.glsl"
#include <params>

flat in uint row;
in vec2 local;

layout(location = 0) out vec4 out_light;   // times its opacity, and that
layout(location = 1) out vec4 out_normal;

void main() {
    float t = dot(local, local) / mask_limit;
    float depth = linear_depth(gl_FragCoord.z);
    if (depth > view_far) discard;
    float opacity = t > 1.0 ? 0.0 : weight_at(0.25 * falloff * t) / FULL;
    uvec2 look = texelFetch(looks, int(row)).xy;
    vec3 normal = normal_of(look);
    out_light = opacity * vec4(light_of(look), 1.0);
    out_normal = vec4(turned(opacity, normal, visible_normal()) * normal, opacity);
}
