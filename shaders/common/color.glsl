// sRGB (IEC 61966-2-1) to linear and back: viewer/srgb.py.

vec3 to_linear(vec3 c) {
    vec3 curve = pow((c + SRGB_OFFSET) / SRGB_SCALE, vec3(SRGB_POWER));
    return mix(c / SRGB_SLOPE, curve, greaterThan(c, vec3(SRGB_ENCODED_KNEE)));
}

vec3 to_srgb(vec3 c) {
    c = clamp(c, 0.0, 1.0);
    vec3 curve = SRGB_SCALE * pow(c, vec3(1.0 / SRGB_POWER)) - SRGB_OFFSET;
    return mix(c * SRGB_SLOPE, curve, greaterThan(c, vec3(SRGB_LINEAR_KNEE)));
}

// Linear light in whole steps, up to LIGHT_STEPS, whose sums are exact; from square roots, up to LIGHT_ROOTS, as stored.
vec3 light_of(vec3 roots) { return roundEven(roots * roots * (LIGHT_STEPS / (LIGHT_ROOTS * LIGHT_ROOTS))); }

vec3 to_roots(vec3 encoded) { return roundEven(sqrt(to_linear(encoded)) * LIGHT_ROOTS); }

// sRGB of such light.
vec3 srgb_of_light(vec3 light) { return to_srgb(light / LIGHT_STEPS); }
