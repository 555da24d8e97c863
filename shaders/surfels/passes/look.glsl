// What a splat gives where splats are blended: linear light, normal, and how much it counts, all of
// them whole numbers, so that sums do not depend on the order as long as they stay below 2^24.
#include "common/color.glsl"
#include "common/octahedron.glsl"

layout(binding = TEXTURE_LOOKS) uniform usamplerBuffer looks;  // roots of light, 3 x 10 bits; normal, 2 x 16 bits

const float FULL = 31.0;  // what the centre of a splat counts

// FULL exp(-4 x) to 0.03, x up to 1: a cubic of exp(-x), to the fourth power.
float weight_at(float x) {
    precise float e = 1.0 + x * (-0.997688 + x * (0.479272 - x * 0.115320));
    e *= e;
    precise float weight = FULL * (e * e);
    return roundEven(weight);
}

const float NORMAL_STEPS = 2047.0;  // of a unit vector

vec3 light_of(uvec2 look) { return light_of(vec3(look.x & 1023u, look.x >> 10 & 1023u, look.x >> 20 & 1023u)); }

vec3 normal_of(uvec2 look) { return roundEven(unpack_normal(look.y) * NORMAL_STEPS); }

// The weight of a normal. A scan's normals need not agree in sign, and would cancel: they count as turned
// like the visible splat's.
float turned(float weight, vec3 normal, vec3 visible) { return dot(normal, visible) < 0.0 ? -weight : weight; }

// Both as whole numbers in three words, which take less to unpack.
uvec3 packed_look(vec3 light, vec3 normal) {
    uvec3 low = uvec3(light), high = uvec3(ivec3(normal));
    return low | high << 16;
}

void unpack_look(uvec3 words, out vec3 light, out vec3 normal) {
    light = vec3(words & 0xFFFFu);
    normal = vec3(ivec3(words) >> 16);
}
