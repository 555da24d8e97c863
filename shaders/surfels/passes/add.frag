// The second pass: what each splat gives, added up.
#include "common/view.glsl"
#include "surfels/passes/visible.glsl"
#include <params>
#include "surfels/passes/layer.glsl"

#if LOCAL
layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
#endif

flat in uint row;
in vec2 local;

layout(location = 0) out vec4 out_light;   // and weight
layout(location = 1) out vec4 out_normal;  // and depth in steps of the layer

void main() {
    float t = dot(local, local) / mask_limit;
    if (t > 1.0) discard;
    float weight = weight_at(0.25 * falloff * t);
    uvec2 look = texelFetch(looks, int(row)).xy;
    vec3 normal = normal_of(look);
    out_light = weight * vec4(light_of(look), 1.0);
    vec3 visible = visible_normal();
    out_normal = turned(weight, normal, visible) * vec4(normal, 0.0);
#if LOCAL
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth = abs(uintBitsToFloat(texelFetch(depths, pixel.y * view_size.x + pixel.x).r)), front = stored_depth(depth);
    float per_key = steps_per_key(front, depth, visible, vec2(pixel) + 0.5);
    out_normal.a = weight * layer_steps(front, gl_FragCoord.z, per_key);
#endif
}
