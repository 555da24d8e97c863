// Sums of samples that are Gaussians in a picture: of weights, and of weights times colour (viewer/backends/laplacian/splats.py).
layout(std430, binding = STORAGE_SUMS) readonly buffer Sums { int sums[]; };

const float steps[] = STEPS;

// The mean in a cell; alpha 0: there is none.
vec4 mean_of_splats(int cell) {
    int weight = sums[4 * cell];
    if (weight <= 0) return vec4(0.0);
    vec3 sum = vec3(sums[4 * cell + 1], sums[4 * cell + 2], sums[4 * cell + 3]);
    return vec4(sum * (steps[1] / steps[0]) / float(weight), 1.0);
}
