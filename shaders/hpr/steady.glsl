// The normal of a steadied point, from the fourth number of its texel (viewer/visibility/spacing.py); 0: it has none.
#include "common/octahedron.glsl"

const float NET_STEPS = 4095.0;

vec3 steady_normal(float word) {
    uint steps = uint(max(word - 1.0, 0.0));
    vec2 net = vec2(steps & 4095u, steps >> 12) / NET_STEPS * 2.0 - 1.0;
    return word > 0.0 ? unfolded(net) : vec3(0.0);
}
