// Samples of a level of a pyramid: values with a weight each, which is not above 0, or not finite, where
// there is none, whatever the values.
#include "common/item.glsl"

layout(binding = TEXTURE_SAMPLES) uniform samplerBuffer samples;  // of the level that is read
layout(binding = TEXTURE_WEIGHTS) uniform samplerBuffer weights;
#if FRONT
layout(binding = TEXTURE_GUIDE) uniform samplerBuffer guide;  // a depth, and up to which others are of one surface with it
#endif
layout(std430, binding = STORAGE_SAMPLES) writeonly buffer Samples { float out_samples[]; };
layout(std430, binding = STORAGE_WEIGHTS) writeonly buffer Weights { float out_weights[]; };

uniform ivec2 size;      // of the level that is read, and of the one that is written
uniform ivec2 out_size;

const float taps[] = TAPS;

// What is known of a sample that is being made: sums of what is there, and of the taps inside the image.
precise vec4 sum;
precise float weight;
precise float inside;
precise float present;  // weight of all surfaces
vec2 front;  // depth of the nearest, and up to which others count

bool is_there(float its_weight) { return its_weight > 0.0 && floatBitsToUint(its_weight) < NO_DEPTH; }

void begin_sample() {
    sum = vec4(0.0);
    weight = inside = present = 0.0;
    front = vec2(uintBitsToFloat(NO_DEPTH));
}

#if FRONT
// Told of all samples before any is added.
void tell_sample(ivec2 at) {
    int i = at.y * size.x + at.x;
    vec2 here = texelFetch(guide, i).xy;
    if (is_there(texelFetch(weights, i).r) && here.x < front.x) front = here;
}
#endif

void add_sample(ivec2 at, float tap) {
    int i = at.y * size.x + at.x;
    float w = texelFetch(weights, i).r;
    inside += tap;
    if (!is_there(w)) return;
    present += tap * w;
#if FRONT
    if (texelFetch(guide, i).x > front.y) return;
#endif
    weight += tap * w;
    sum += tap * w * texelFetch(samples, i);
}

vec4 mean_sample() { return weight > 0.0 ? sum / weight : vec4(0.0); }

void store_sample(uint i, vec4 value, float its_weight) {
    for (uint k = 0u; k < CHANNELS; ++k) out_samples[CHANNELS * i + k] = value[k];
    out_weights[i] = its_weight;
}
