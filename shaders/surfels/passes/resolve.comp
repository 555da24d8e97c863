// What the splats gave, divided by how much they counted. OVER: they were drawn over one another.
// Pixels that were filled are listed for surfels/passes/close.comp.
#include "common/view.glsl"
#include "common/item.glsl"
#include "surfels/passes/look.glsl"
#include "surfels/passes/store.glsl"
#include "common/list.glsl"
#if LOCAL
#include <params>
#include "surfels/passes/layer.glsl"
layout(std430, binding = STORAGE_LOCAL_DEPTHS) writeonly buffer LocalDepths { uint local_depths[]; };
#endif

layout(binding = TEXTURE_COLOR_SUMS) uniform sampler2D color_sums;
layout(binding = TEXTURE_NORMAL_SUMS) uniform sampler2D normal_sums;
layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;

void main() {
    int index = int(item());
    if (index >= view_size.x * view_size.y) return;
    uint row = texelFetch(rows, index).r;
    if (row == NOTHING) return;
    ivec2 pixel = ivec2(index % view_size.x, index / view_size.x);
    vec4 light = texelFetch(color_sums, pixel, 0);
    vec4 sums = texelFetch(normal_sums, pixel, 0);
    vec3 normal = sums.xyz;
    float total = light.a > 0.0 ? light.a : 1.0;
    float coverage = OVER != 0 ? light.a : 1.0;
    uvec2 look = texelFetch(looks, int(row)).xy;
    store_mean(index, light.rgb / total, normal / total, light.a > 0.0, coverage, light_of(look), normal_of(look));
#if LOCAL
    float depth = abs(uintBitsToFloat(texelFetch(depths, index).r)), front = stored_depth(depth);
    float per_key = steps_per_key(front, depth, normal_of(look), vec2(pixel) + 0.5);
    local_depths[index] = floatBitsToUint(depth_of_steps(front, sums.a / total, per_key));
#endif
    if (uintBitsToFloat(texelFetch(depths, index).r) < 0.0) list[reserve(1u)] = uint(index);
}
