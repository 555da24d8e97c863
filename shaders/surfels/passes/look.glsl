// What a splat gives where splats are blended: colour, normal, and how much it counts, all of
// them whole numbers, so that sums do not depend on the order as long as they stay below 2^24.

layout(binding = TEXTURE_LOOKS) uniform usamplerBuffer looks;  // colour, 3 x 8 bits; normal, 3 x 10 bits

const float FULL = 127.0;  // what the centre of a splat counts

// FULL exp(-4 x) to 0.05, x up to 1: a cubic of exp(-x), to the fourth power.
float weight_at(float x) {
    float e = 3.35699 + x * (-3.34923 + x * (1.60891 - x * 0.38713));
    e *= e;
    return roundEven(e * e);
}

vec3 color_of(uvec2 look) { return vec3(look.x & 255u, look.x >> 8 & 255u, look.x >> 16 & 255u); }

vec3 normal_of(uvec2 look) {
    return vec3(look.y & 1023u, look.y >> 10 & 1023u, look.y >> 20 & 1023u) - 512.0;
}

// The weight of a normal. A scan's normals need not agree in sign, and would cancel: they count as turned
// like the visible splat's.
float turned(float weight, vec3 normal, vec3 visible) { return dot(normal, visible) < 0.0 ? -weight : weight; }
