#include "common/octahedron.glsl"

// What a sample shows: linear colour, normal along the pose's axes (0: unknown), value; and the same in four words.
struct Seen {
    vec3 color;
    vec3 normal;
    float value;
};

const Seen UNSEEN = Seen(vec3(0.0), vec3(0.0), 0.0);

uvec4 pack_seen(Seen seen) {
    return uvec4(
        packHalf2x16(seen.color.rg),
        packHalf2x16(vec2(seen.color.b, 0.0)),
        pack_normal(seen.normal),
        floatBitsToUint(seen.value)
    );
}

Seen unpack_seen(uvec4 words) {
    vec3 color = vec3(unpackHalf2x16(words.x), unpackHalf2x16(words.y).x);
    return Seen(color, unpack_normal(words.z), uintBitsToFloat(words.w));
}

// A cell of a target has, beside what its sample shows, how many of the cells are filled below it, of the level that
// samples are dense in (`density`).
uvec4 with_filled(uvec4 words, uint count) {
    words.y = words.y & 0xFFFFu | count << 16;
    return words;
}

uint count_filled(uvec4 words) { return words.y >> 16; }
