// What a splat gives where splats are blended: linear light, normal, and how much it counts, all of
// them whole numbers, so that sums do not depend on the order as long as they stay below 2^24.
#include "common/color.glsl"

layout(binding = TEXTURE_LOOKS) uniform usamplerBuffer looks;  // roots of light, 3 x 10 bits; normal, 3 x 10 bits

const float FULL = 31.0;  // what the centre of a splat counts

// FULL exp(-4 x) to 0.03, x up to 1: a cubic of exp(-x), to the fourth power.
float weight_at(float x) {
    float e = 1.0 + x * (-0.997688 + x * (0.479272 - x * 0.115320));
    e *= e;
    return roundEven(FULL * (e * e));
}

vec3 steps_of(uint word) { return vec3(word & 1023u, word >> 10 & 1023u, word >> 20 & 1023u); }

vec3 light_of(uvec2 look) { return light_of(steps_of(look.x)); }

vec3 normal_of(uvec2 look) { return steps_of(look.y) - 512.0; }

// The weight of a normal. A scan's normals need not agree in sign, and would cancel: they count as turned
// like the visible splat's.
float turned(float weight, vec3 normal, vec3 visible) { return dot(normal, visible) < 0.0 ? -weight : weight; }
