// What splats gave as Slomp 2014 prints them, as a Surface has it: by no point.
#include "common/view.glsl"
#include "common/item.glsl"

layout(binding = TEXTURE_COLOR_SUMS) uniform sampler2D blended;
layout(binding = TEXTURE_LARGE_DEPTHS) uniform sampler2D nearest_keys;
layout(std430, binding = STORAGE_DEPTHS) writeonly buffer Depths { uint depths[]; };
layout(std430, binding = STORAGE_COLOR) writeonly buffer Color { uint own_colors[]; };

void main() {
    int index = int(item());
    if (index >= view_size.x * view_size.y) return;
    ivec2 pixel = ivec2(index % view_size.x, index / view_size.x);
    vec4 color = texelFetch(blended, pixel, 0);
    float key = texelFetch(nearest_keys, pixel, 0).r;
    if (color.a == 0.0 || key == 0.0) return;
    float depth = max(linear_depth(key), view_near);
    if (depth > view_far) return;
    depths[index] = floatBitsToUint(depth);
    own_colors[index] = packUnorm4x8(vec4(color.rgb / color.a, color.a));
}
