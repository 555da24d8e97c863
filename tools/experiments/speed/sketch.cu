// The scatter of sketch.comp with 64-bit words, in CUDA.
typedef unsigned long long Key;
#define FAR 0xFFFFFFFFFFFFFFFFull

extern "C" __global__ void clear(Key* keys, int pixels) {
    int i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i < pixels) keys[i] = FAR;
}

extern "C" __global__ void scatter(const float* positions, const float* to_clip, Key* keys, long long count,
                                   int width, int height, float radius) {
    long long i = blockIdx.x * (long long)blockDim.x + threadIdx.x;
    if (i >= count) return;
    float x = positions[3 * i], y = positions[3 * i + 1], z = positions[3 * i + 2];
    const float* m = to_clip;  // row by row
    float w = m[12] * x + m[13] * y + m[14] * z + m[15];
    if (w <= 0.f) return;
    float across = ((m[0] * x + m[1] * y + m[2] * z + m[3]) / w * 0.5f + 0.5f) * width;
    float down = ((m[4] * x + m[5] * y + m[6] * z + m[7]) / w * -0.5f + 0.5f) * height;
    Key key = ((Key)__float_as_uint(w) << 32) | (unsigned)i;
    float reach = radius > 0.f ? fmaxf(0.5f, radius / w) : 0.f;
    int left = radius > 0.f ? ceilf(across - reach - 0.5f) : floorf(across);
    int right = radius > 0.f ? floorf(across + reach - 0.5f) : left;
    int top = radius > 0.f ? ceilf(down - reach - 0.5f) : floorf(down);
    int bottom = radius > 0.f ? floorf(down + reach - 0.5f) : top;
    for (int v = max(top, 0); v <= min(bottom, height - 1); v++)
        for (int u = max(left, 0); u <= min(right, width - 1); u++) {
            float a = u + 0.5f - across, b = v + 0.5f - down;
            Key* cell = keys + (long long)v * width + u;
            if ((radius == 0.f || a * a + b * b <= reach * reach) && *(volatile Key*)cell > key) atomicMin(cell, key);
        }
}

extern "C" __global__ void resolve(const Key* keys, const unsigned* colors, unsigned* picture, int pixels) {
    int i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i < pixels) picture[i] = keys[i] == FAR ? 0xFF000000u : colors[(unsigned)keys[i]];
}
