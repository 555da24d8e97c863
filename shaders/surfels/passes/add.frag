// The second pass: what each splat gives, added up.
#include "common/view.glsl"
#include "surfels/passes/visible.glsl"
#include <params>

flat in uint row;
in vec2 local;

layout(location = 0) out vec4 out_light;   // and weight
layout(location = 1) out vec4 out_normal;

void main() {
    float t = dot(local, local) / mask_limit;
    if (t > 1.0) discard;
    float weight = weight_at(0.25 * falloff * t);
    uvec2 look = texelFetch(looks, int(row)).xy;
    vec3 normal = normal_of(look);
    out_light = weight * vec4(light_of(look), 1.0);
    out_normal = turned(weight, normal, visible_normal()) * vec4(normal, 0.0);
}
