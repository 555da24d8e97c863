// A splat in three words. The normal's; the bits of its radius, of an ellipse the shorter half-axis; and of
// the longer one: its angle, 0 to 1 for half a turn, and what it makes of the shorter one's length, 1 where it is round.
#include "common/octahedron.glsl"
#include "common/tangent.glsl"

const uint ROUND = 0xFFFFu;

vec3 packed_normal(uvec3 words) { return unfolded(unpackSnorm2x16(words.x)); }

float packed_radius(uvec3 words) { return uintBitsToFloat(words.y); }

// The direction of the longer half-axis, unit length.
vec3 packed_longer(uvec3 words) {
    vec3 n = packed_normal(words), u = tangent_of(n);
    float angle = unpackUnorm2x16(words.z).x * 3.14159265;
    return cos(angle) * u + sin(angle) * cross(n, u);
}

// The longer half-axis, and the shorter one's length, which is given; 0 where the splat is round.
vec4 packed_axes(uvec3 words, float shorter) {
    if (words.z >> 16 == ROUND) return vec4(0.0);
    float roundness = unpackUnorm2x16(words.z).y;
    return vec4(packed_longer(words) * (shorter / max(roundness, 1.0 / ROUND)), shorter);
}
