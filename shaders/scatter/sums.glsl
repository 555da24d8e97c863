// Sums of CHANNELS numbers per cell, as whole numbers of STEPS: exact, so that they do not depend on the order. Numbers
// beyond LIMITS count as those, which keeps sums within 32 bits (FixedPoint in viewer/gpu/scatter.py).
layout(std430, binding = STORAGE_SUMS) buffer Sums { int sums[]; };

const float limits[] = LIMITS;
const float steps[] = STEPS;

void add(uint cell, float numbers[CHANNELS]) {
    for (uint k = 0u; k < CHANNELS; ++k) {
        float number = clamp(numbers[k], -limits[k], limits[k]);
        atomicAdd(sums[CHANNELS * cell + k], int(roundEven(number / steps[k])));
    }
}
