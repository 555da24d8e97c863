// Colour and normal of each row in two words, as surfels/passes/look.glsl reads them. COLORED, SHAPED: whether there are
// colours and normals; a word is 0 without. Normals have any length.
#include "common/item.glsl"

layout(binding = TEXTURE_COLORS) uniform samplerBuffer colors;
layout(binding = TEXTURE_NORMALS) uniform samplerBuffer normals;
layout(binding = TEXTURE_LIGHT) uniform usamplerBuffer roots;  // of the light of a byte
layout(std430, binding = STORAGE_LOOKS) writeonly buffer Looks { uvec2 packed_looks[]; };

float with_sign(float size, float of) {
    return uintBitsToFloat((floatBitsToUint(size) & 0x7FFFFFFFu) | (floatBitsToUint(of) & 0x80000000u));
}

// The word of a normal, as `_folded` of viewer/splatting/looks.py has it.
uint folded_word(vec3 normal) {
    float largest = max(max(abs(normal.x), abs(normal.y)), abs(normal.z));
    if (any(isnan(normal)) || any(isinf(normal)) || largest == 0.0) return 0u;
    precise vec3 part = normal / largest;
    precise float size = abs(part.x) + abs(part.y) + abs(part.z);
    precise vec3 net = part / size;
    precise vec2 left = 1.0 - abs(net.yx);
    vec2 turned = vec2(with_sign(left.x, net.x), with_sign(left.y, net.y));
    precise vec2 steps = (net.z < 0.0 ? turned : net.xy) * 32767.0;
    uvec2 words = uvec2(ivec2(roundEven(steps))) & 0xFFFFu;
    return max(words.x | words.y << 16, 1u);
}

void main() {
    int row = int(item());
    if (uint(row) >= item_count) return;
    uvec2 look = uvec2(0u);
#if COLORED
    ivec3 bytes = ivec3(roundEven(255.0 * texelFetch(colors, row).rgb));
    for (int i = 0; i < 3; ++i) look.x |= texelFetch(roots, bytes[i]).r << uint(10 * i);
#endif
#if SHAPED
    look.y = folded_word(texelFetch(normals, row).xyz);
#endif
    packed_looks[row] = look;
}
