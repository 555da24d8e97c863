// What splats gave, divided by their weights, as a Surface has it: by no point.
#include "common/view.glsl"
#include "common/color.glsl"
#include "common/item.glsl"

layout(binding = TEXTURE_COLOR_SUMS) uniform sampler2D color_sums;
layout(binding = TEXTURE_NORMAL_SUMS) uniform sampler2D depth_sums;
layout(std430, binding = STORAGE_DEPTHS) writeonly buffer Depths { uint depths[]; };
layout(std430, binding = STORAGE_COLOR) writeonly buffer Color { uint own_colors[]; };

void main() {
    int index = int(item());
    if (index >= view_size.x * view_size.y) return;
    ivec2 pixel = ivec2(index % view_size.x, index / view_size.x);
    vec4 light = texelFetch(color_sums, pixel, 0);
    if (light.a == 0.0) return;
    depths[index] = floatBitsToUint(texelFetch(depth_sums, pixel, 0).x / light.a);
    own_colors[index] = packUnorm4x8(vec4(to_srgb(light.rgb / light.a), 1.0));
}
