// The tiles that discs reach, in the order of homes; what they are is written down. MASKED: entries of tiles say which parts
// the disc reaches.
#include "surfels/tiles/reach.glsl"
#include "surfels/tiles/counted.glsl"
#include "amplify/texels.glsl"
#include "surfels/disc.glsl"

layout(binding = TEXTURE_REACH) uniform usamplerBuffer reach;
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;
layout(std430, binding = STORAGE_CENTERS) writeonly buffer Centers { vec4 centers[]; };
layout(std430, binding = STORAGE_FORMS) writeonly buffer Forms { vec4 forms[]; };
#if LOOKS
#include "surfels/passes/look.glsl"
layout(std430, binding = STORAGE_DISC_LOOKS) writeonly buffer DiscLooks { uvec4 disc_looks[]; };  // and radius, as stored
#endif

#if MASKED
float margin;  // what is inside of a part at most changes by from its middle, of the key and of the form's root

void begin_parts(vec3 key, vec3 form) {
    vec2 side = 0.5 * vec2(PART - 1);
    margin = sqrt(form.x * side.x * side.x + 2.0 * abs(form.y) * side.x * side.y + form.z * side.y * side.y);
    if (view_perspective) margin += dot(abs(key.yz), side);
}

// The parts of a tile that the disc may reach, a bit each: of those in its box, where the middle is near enough. A form is
// the square of a norm, so that the triangle inequality holds.
uint bits_of(ivec4 parts, ivec2 tile, vec2 center, vec3 key, vec3 form) {
    uint bits = 0u;
    for (int k = 0; k < ALL_PARTS; ++k) {
        ivec2 part = tile * PARTS + ivec2(k % COLUMNS, k / COLUMNS);
        vec2 off = vec2(part * PART) + 0.5 * vec2(PART) - center;
        float edge = (view_perspective ? key.x + dot(key.yz, off) : 1.0) + margin;
        float shape = form.x * off.x * off.x + off.y * (2.0 * form.y * off.x + form.z * off.y);
        bool is_in_box = all(greaterThanEqual(part, parts.xy)) && all(lessThan(part, parts.zw));
        bits |= is_in_box && shape <= 1.001 * edge * edge ? 1u << k : 0u;
    }
    return bits;
}
#endif

void scatter(uint at) {
    if (at >= disc_count()) return;
    uint disc = first_disc + at, i = texelFetch(listed, int(first_home + at)).r;
    Point point = texel_point(drawn_row(int(i)));
    begin_disc(point);
    vec2 center = to_pixel(disc_center);
    vec3 form, key = disc_key(form);
    centers[disc] = vec4(center, key.xy);
    forms[disc] = vec4(key.z, form);
#if LOOKS
    uvec2 look = texelFetch(looks, int(point.row)).xy;
    disc_looks[disc] = uvec4(packed_look(light_of(look), normal_of(look)), floatBitsToUint(point.radius));
#endif
#if MASKED
    begin_parts(key, form);
#endif
    ivec4 parts = unpacked_parts(texelFetch(reach, int(i)).xy), t = tiles_of(parts);
    ivec2 tile = t.xy;
    do {
        uint entry = disc;
#if MASKED
        entry |= bits_of(parts, tile, center, key, form) << DISC_BITS;
#endif
        visit(cell_of(tile), 0u, entry);
        tile = next_tile(tile, t);
    } while (tile.y < t.w);
}
