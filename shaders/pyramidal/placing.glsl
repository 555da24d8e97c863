// What becomes of a sample that lies at a pixel coordinate. SUMS 0: it visits that pixel. SUMS 1, 2: it is a point spread
// function, a Gaussian over KERNEL x KERNEL pixels placed to a part of a pixel, and adds to those whose surface it is on
// (Farooq 2013, chapter 5): by a table of kernels, or by the integral of each.
// What includes it says `vec3 color_of_item(item)`, linear.
#if SUMS
const float FRONT = 3.0;  // how far behind what a pixel shows a sample of the same surface may lie, in pixels

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer front;  // of the samples that pixels show

#if SUMS == 1
layout(binding = TEXTURE_KERNELS) uniform samplerBuffer kernels;
#else
// The error function (Abramowitz and Stegun 7.1.26; to 1.5e-7).
float erf(float x) {
    float t = 1.0 / (1.0 + 0.3275911 * abs(x));
    float sum = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))));
    return sign(x) * (1.0 - sum * exp(-x * x));
}

// What of a Gaussian of spread 0.5 around `offset` lies over the pixel that is so many away.
float over_pixel(int away, float offset) {
    float left = float(away) - 0.5 - offset;
    return 0.5 * (erf(sqrt(2.0) * (left + 1.0)) - erf(sqrt(2.0) * left));
}
#endif

void place_sample(vec2 place, float depth, uint item_id) {
    // From the middle of a pixel, -0.5 to 0.5: what lies beyond belongs to the next (5.4.1).
    ivec2 middle = ivec2(floor(place));
    vec2 offset = place - vec2(middle) - 0.5;
    vec3 color = color_of_item(item_id);
    const int reach = KERNEL / 2;
#if SUMS == 1
    ivec2 entry = clamp(ivec2((offset + 0.5) * float(KERNEL_STEPS)), ivec2(0), ivec2(KERNEL_STEPS - 1));
    int first = (entry.y * KERNEL_STEPS + entry.x) * KERNEL * KERNEL;
#endif
    for (int y = -reach; y <= reach; ++y)
        for (int x = -reach; x <= reach; ++x) {
            ivec2 at = middle + ivec2(x, y);
            if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, view_size))) continue;
            int pixel = at.y * view_size.x + at.x;
            float before = uintBitsToFloat(texelFetch(front, pixel).r);
            if (isinf(before) || abs(depth - before) > FRONT / scale_at(before)) continue;
#if SUMS == 1
            float weight = texelFetch(kernels, first + (y + reach) * KERNEL + x + reach).r;
#else
            float weight = over_pixel(x, offset.x) * over_pixel(y, offset.y);
#endif
            add(uint(pixel), float[](weight, weight * color.r, weight * color.g, weight * color.b));
        }
}
#else
void place_sample(vec2 place, float depth, uint item_id) {
    if (any(lessThan(place, vec2(0.0))) || any(greaterThanEqual(place, vec2(view_size)))) return;
    visit(uint(int(place.y) * view_size.x + int(place.x)), floatBitsToUint(depth), item_id);
}
#endif
