// Samples of a level whose splats are smaller than its cells are taken away, so that surfaces do not grow beyond their
// outlines; the others are told the level, and count alike.
#include "common/item.glsl"

layout(std430, binding = STORAGE_SAMPLES) buffer Samples { vec4 samples[]; };
layout(std430, binding = STORAGE_WEIGHTS) buffer Weights { float weights[]; };

uniform int level;
uniform float reach;  // of a splat, in cells, at least

void main() {
    uint i = item();
    if (i >= item_count) return;
    samples[i].w = float(level);
    weights[i] = float(weights[i] > 0.0 && samples[i].z >= reach * exp2(float(level)));
}
