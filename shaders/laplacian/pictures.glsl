// A view's picture: linear colour of what it sees of the surface that a pixel shows, and the view's weight there, 0: it does
// not see it; two words a pixel. Later its difference to the merged picture, and its shares of that.
// LOGARITHMIC: bands are of the logarithm of light, in which a gain is the same everywhere; DARK keeps black from counting.

uvec2 pack_seen_by(vec3 color, float weight) {
    return uvec2(packHalf2x16(color.rg), packHalf2x16(vec2(color.b, weight)));
}

vec4 unpack_seen_by(uvec2 words) { return vec4(unpackHalf2x16(words.x), unpackHalf2x16(words.y)); }

// shares: of all bands but the coarsest, and of that; the latter is above 0 where the view sees anything.
uvec2 pack_difference(vec3 difference, vec2 shares) {
    uint words = packUnorm4x8(vec4(0.0, 0.0, shares.x, max(shares.y, 1.0 / 255.0)));
    return uvec2(packHalf2x16(difference.rg), packHalf2x16(vec2(difference.b, 0.0)) | words);
}

vec3 unpack_difference(uvec2 words) { return vec3(unpackHalf2x16(words.x), unpackHalf2x16(words.y & 0xFFFFu).x); }

vec2 unpack_shares(uvec2 words) { return unpackUnorm4x8(words.y).zw; }

// As it is read again.
float rounded_weight(float weight) { return unpackHalf2x16(packHalf2x16(vec2(weight, 0.0))).x; }

const float DARK = 0.02;

#if LOGARITHMIC
vec3 to_banded(vec3 light) { return log(max(light, 0.0) + DARK); }

vec3 from_banded(vec3 banded) { return exp(banded) - DARK; }
#else
vec3 to_banded(vec3 light) { return light; }

vec3 from_banded(vec3 banded) { return banded; }
#endif
