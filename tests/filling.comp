// Fills pixels that no point covers with the mean of those at the least distance that some cover. Only pixels with a
// row are read, only those without are written, so that the order does not matter.
#include "common/view.glsl"
#include "common/item.glsl"
#include <params>

layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
layout(std430, binding = STORAGE_DEPTHS) buffer Depths { uint depths[]; };
layout(std430, binding = STORAGE_LEVEL) writeonly buffer Level { uint own_levels[]; };
#if FILL_COLOR
layout(std430, binding = STORAGE_COLOR) buffer Color { uint own_colors[]; };
#endif
#if FILL_NORMAL
layout(std430, binding = STORAGE_NORMAL) buffer Normal { float own_normals[]; };
#endif
#if FILL_VALUE
layout(std430, binding = STORAGE_VALUE) buffer Value { float own_values[]; };
#endif

bool is_measured(ivec2 pixel) {
    if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, view_size))) return false;
    return texelFetch(rows, pixel.y * view_size.x + pixel.x).r != NOTHING;
}

void main() {
    int index = int(item());
    if (index >= view_size.x * view_size.y) return;
    ivec2 pixel = ivec2(index % view_size.x, index / view_size.x);
    own_levels[index] = 0u;
    if (is_measured(pixel)) return;
    for (int level = 1; level <= levels; ++level) {
        float count = 0.0, depth = 0.0, value = 0.0;
        vec3 normal = vec3(0.0);
        vec4 color = vec4(0.0);
        for (int y = -level; y <= level; ++y)
            for (int x = -level; x <= level; ++x) {
                ivec2 other = pixel + ivec2(x, y);
                if (!is_measured(other)) continue;
                int there = other.y * view_size.x + other.x;
                count += 1.0;
                depth += uintBitsToFloat(depths[there]);
#if FILL_COLOR
                color += unpackUnorm4x8(own_colors[there]);
#endif
#if FILL_NORMAL
                for (int k = 0; k < 3; ++k) normal[k] += own_normals[3 * there + k];
#endif
#if FILL_VALUE
                value += own_values[there];
#endif
            }
        if (count == 0.0) continue;
        depths[index] = floatBitsToUint(depth / count);
        own_levels[index] = uint(level);
#if FILL_COLOR
        own_colors[index] = packUnorm4x8(color / count);
#endif
#if FILL_NORMAL
        for (int k = 0; k < 3; ++k) own_normals[3 * index + k] = normal[k];
#endif
#if FILL_VALUE
        own_values[index] = value / count;
#endif
        return;
    }
}
