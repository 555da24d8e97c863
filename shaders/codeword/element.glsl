// An element in four words: the corner of pixels that its centre is rounded to, right and down, with the steps of its
// normal above them; its size, 0: it shows nothing; bits of its depth.
const float MOST_SIZE = 1e6;
const int CORNER_BITS = 24, NORMAL_ZERO = 128;
const int CORNER_ZERO = 1 << CORNER_BITS - 1;
const uint CORNER_MASK = (1u << CORNER_BITS) - 1u;

uvec4 packed_element(ivec2 corner, uint size, ivec2 normal, float depth) {
    uvec2 words = uvec2(corner + CORNER_ZERO) | uvec2(normal + NORMAL_ZERO) << CORNER_BITS;
    return uvec4(words, size, floatBitsToUint(depth));
}

ivec2 corner_of(uvec4 element) { return ivec2(element.xy & CORNER_MASK) - CORNER_ZERO; }

ivec2 normal_of(uvec4 element) { return ivec2(element.xy >> CORNER_BITS) - NORMAL_ZERO; }

// Bits of a float as a number that is the larger the larger it is.
uint ordered(uint bits) { return bits >> 31 != 0u ? ~bits : bits | 1u << 31; }
