// Softens the picture of a preview: viewer/picture/soften.py.
// STEP 0: closes holes: a pixel becomes the mean of those around it that see something clearly nearer, where these are at
// least HOLE of the 8. 1: each pixel becomes the mean of the 3 x 3 around it, weighted 4, 2 and 1.
// An invocation goes along RUN pixels of a row, so that it reads what two pixels share once.
#include "common/view.glsl"
#include "common/item.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;  // float bits
layout(binding = TEXTURE_SHADED) uniform usamplerBuffer picture;  // as it was before the step
layout(std430, binding = STORAGE_PICTURE) writeonly buffer Picture { uint softened[]; };

const uint EVEN = 0x00FF00FFu;  // two of a word's bytes, each with room for the sum of 256
const float CLEARLY = 8.0;      // pixels of depth: what rises by less from a pixel to the next may be one surface

int place(int x, int y) { return clamp(y, 0, view_size.y - 1) * view_size.x + clamp(x, 0, view_size.x - 1); }

#if STEP == 0
float depth_at(int x, int y) { return uintBitsToFloat(texelFetch(depths, place(x, y)).r); }

// A pixel where it is no hole, else the mean of those around it that see something nearer than a depth.
uint closed(int x, int y, float before) {
    uvec4 sum = uvec4(0u);
    uint count = 0u;
    for (int k = 0; k < 9; ++k) {
        int other = place(x + k % 3 - 1, y + k / 3 - 1);
        if (!(uintBitsToFloat(texelFetch(depths, other).r) < before)) continue;
        sum += uvec4(texelFetch(picture, other).r) >> uvec4(0u, 8u, 16u, 24u) & 255u;
        ++count;
    }
    if (count < uint(HOLE)) return texelFetch(picture, place(x, y)).r;
    // Whole parts, by a quotient that is never near the next one: software drivers divide integers slowly.
    sum = uvec4((vec4(sum) + 0.5) / float(count));
    return sum.x | sum.y << 8 | sum.z << 16 | sum.w << 24;
}
#else
// The bytes of a column, weighted 1, 2 and 1, in two sums.
uvec2 column(int x, int y) {
    uint above = texelFetch(picture, place(x, y - 1)).r, middle = texelFetch(picture, place(x, y)).r;
    uint below = texelFetch(picture, place(x, y + 1)).r;
    return uvec2((above & EVEN) + 2u * (middle & EVEN) + (below & EVEN),
                 (above >> 8 & EVEN) + 2u * (middle >> 8 & EVEN) + (below >> 8 & EVEN));
}
#endif

void main() {
    int runs = (view_size.x + RUN - 1) / RUN, y = int(item()) / runs, first = int(item()) % runs * RUN;
    if (y >= view_size.y) return;
#if STEP == 0
    float left = depth_at(first - 1, y), middle = depth_at(first, y);
    for (int x = first; x < min(first + RUN, view_size.x); ++x) {
        float right = depth_at(x + 1, y);
        float before = middle;  // what is nearer than this is clearly nearer than the pixel
        if (!isinf(before)) before -= CLEARLY / scale_at(before + view_base);
        int nearer = int(left < before) + int(right < before);
        if (nearer > 0) nearer += int(depth_at(x, y - 1) < before) + int(depth_at(x, y + 1) < before);
        if (nearer >= HOLE - 4) softened[y * view_size.x + x] = closed(x, y, before);
        left = middle;
        middle = right;
    }
#else
    uvec2 left = column(first - 1, y), middle = column(first, y);
    for (int x = first; x < min(first + RUN, view_size.x); ++x) {
        uvec2 right = column(x + 1, y);
        uvec2 mean = left + 2u * middle + right + 0x00080008u >> 4 & EVEN;
        uint word = mean.x | mean.y << 8;
        int i = y * view_size.x + x;
        if (word != texelFetch(picture, i).r) softened[i] = word;  // stores take long on software drivers
        left = middle;
        middle = right;
    }
#endif
}
