// The mean of pictures, in linear light as far as they cover what lies behind: viewer/picture/mean.py.
// STEP 0: adds a picture to the sums, which START begins. 1: writes the mean of so many.
#include "common/item.glsl"

layout(std430, binding = STORAGE_PICTURE) buffer Picture { uint picture[]; };
layout(std430, binding = STORAGE_LIGHT_SUMS) buffer LightSums { uvec4 light_sums[]; };  // light times alpha, alpha
layout(binding = TEXTURE_LIGHT) uniform usamplerBuffer light;  // of a byte
layout(binding = TEXTURE_ENCODED) uniform usamplerBuffer encoded;  // byte of light in parts of steps
uniform int pixels, count;

uvec4 bytes_of(uint word) { return (uvec4(word) >> uvec4(0u, 8u, 16u, 24u)) & 255u; }

void main() {
    int i = int(item());
    if (i >= pixels) return;
#if STEP == 0
    uvec4 bytes = bytes_of(picture[i]), sum = uvec4(0u, 0u, 0u, bytes.a);
    for (int k = 0; k < 3; ++k) sum[k] = texelFetch(light, int(bytes[k])).r * bytes.a;
    light_sums[i] = count > 0 ? light_sums[i] + sum : sum;
#else
    uvec4 sum = light_sums[i];
    if (sum.a == 0u) return;  // all of them show the same background
    uint word = (2u * sum.a + uint(count)) / uint(2 * count) << 24;
    for (int k = 0; k < 3; ++k) {
        uint mean = (uint(LIGHT_PARTS) * sum[k] + sum.a / 2u) / sum.a;
        word |= texelFetch(encoded, int(mean)).r << 8 * k;
    }
    picture[i] = word;
#endif
}
