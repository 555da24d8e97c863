// Remainder and quotient of whole numbers from 0 on. By floats and a correction: processors have no integer division of
// several numbers at once, so that software drivers take it one by one.
ivec2 split(int number, int by) {
    int quotient = int(float(number) / float(by)), rest = number - quotient * by;
    int missed = rest < 0 ? -1 : rest >= by ? 1 : 0;
    return ivec2(rest - missed * by, quotient + missed);
}

// Means of whole numbers from sums of `count`, less than 2^20, of them: to 12 bits behind the point, and the same for as
// many times the sum of as many times the count. Means are to be below 2^12.
vec3 means_of(uvec3 sums, uint count) {
    float per = 1.0 / float(count);
    uvec3 steps = uvec3(vec3(sums) * (4096.0 * per));   // of 12 bits, within 8 of what they are
    ivec3 rest = ivec3((sums << 12) - steps * count);   // whatever was lost above 32 bits
    ivec3 missed = ivec3(floor(vec3(rest) * per));      // within 1
    rest -= missed * int(count);
    missed += ivec3(greaterThanEqual(rest, ivec3(count))) - ivec3(lessThan(rest, ivec3(0)));
    return vec3(ivec3(steps) + missed) / 4096.0;
}

vec3 means_of(ivec3 sums, uint count) { return vec3(sign(sums)) * means_of(uvec3(abs(sums)), count); }
