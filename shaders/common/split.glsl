// Remainder and quotient of whole numbers from 0 on. By floats and a correction: processors have no integer division of
// several numbers at once, so that software drivers take it one by one.
ivec2 split(int number, int by) {
    int quotient = int(float(number) / float(by)), rest = number - quotient * by;
    int missed = rest < 0 ? -1 : rest >= by ? 1 : 0;
    return ivec2(rest - missed * by, quotient + missed);
}

// Quotients without remainder, which are to be below 2^20; the same way.
uvec3 quotients(uvec3 numbers, uint by) {
    uvec3 found = uvec3(vec3(numbers) / float(by));
    ivec3 rest = ivec3(numbers - found * by);
    return found + uvec3(greaterThanEqual(rest, ivec3(by))) - uvec3(lessThan(rest, ivec3(0)));
}

// Means of whole numbers from sums of `count`, less than 2^20, of them: to 12 bits behind the point, and the same for as
// many times the sum of as many times the count. Means are to be below 2^12.
vec3 means_of(uvec3 sums, uint count) {
    uvec3 whole = quotients(sums, count);
    return vec3(whole) + vec3(quotients(sums - whole * count << 12, count)) / 4096.0;
}

vec3 means_of(ivec3 sums, uint count) { return vec3(sign(sums)) * means_of(uvec3(abs(sums)), count); }
