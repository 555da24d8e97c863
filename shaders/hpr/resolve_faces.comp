// What pixels show of the faces and points that were sent to them: the row of the nearest corner; colour, normal and value
// between those of all three.
#include "common/item.glsl"
#include "common/color.glsl"
#include "amplify/packed.glsl"
#include "common/split.glsl"
#include "hpr/drawn_faces.glsl"

layout(binding = TEXTURE_SPLATS) uniform usamplerBuffer splats;
layout(std430, binding = STORAGE_DEPTHS) buffer Depths { uint depths[]; };
layout(std430, binding = STORAGE_ROWS) buffer Rows { uint rows[]; };
layout(std430, binding = STORAGE_NORMAL) writeonly buffer Normal { float own_normals[]; };
#if HAS_COLORS
layout(binding = TEXTURE_COLORS) uniform samplerBuffer colors;
layout(std430, binding = STORAGE_COLOR) writeonly buffer Color { uint own_colors[]; };
#endif
#if HAS_VALUES
layout(binding = TEXTURE_VALUES) uniform samplerBuffer values;
layout(std430, binding = STORAGE_VALUE) writeonly buffer Value { float own_values[]; };
#endif

uniform int first_point;

// The corner nearest to a place between them, the first of several.
uint nearest_corner(uvec3 corners, vec3 shares) {
    vec3 place = vec3(0.0);
    for (int k = 0; k < 3; ++k) place += shares[k] * to_view(texelFetch(positions, int(corners[k])).xyz);
    float least = UNKNOWN;
    uint nearest = corners.x;
    for (int k = 0; k < 3; ++k) {
        float away = length(to_view(texelFetch(positions, int(corners[k])).xyz) - place);
        if (away < least) nearest = corners[k];
        least = min(least, away);
    }
    return nearest;
}

void main() {
    uint pixel = item();
    if (pixel >= item_count) return;
    uint number = rows[pixel];
    depths[pixel] = number == NOTHING ? NO_DEPTH : depths[pixel] & ~BEHIND_FACES;
    if (number == NOTHING) return;
    uvec3 corners = uvec3(number - uint(first_point));
    vec3 shares = vec3(1.0, 0.0, 0.0);
    if (number < uint(first_point)) {
        corners = faces_of(number >> 1).corners[number & 1u];
        Drawn face = drawn_face(corners);
        vec2 center = vec2(split(int(pixel), view_size.x)) + 0.5;
        shares = shares_in_space(face.depths, shares_at(face.pixels[0], face.pixels[1], face.pixels[2], center));
    }
    rows[pixel] = nearest_corner(corners, shares);
    vec3 normal = vec3(0.0), color = vec3(0.0);
    float value = 0.0;
    for (int k = 0; k < 3; ++k) {
        int row = int(corners[k]);
        normal += shares[k] * packed_normal(texelFetch(splats, row).xyz);
#if HAS_COLORS
        color += shares[k] * to_linear(texelFetch(colors, row).rgb);
#endif
#if HAS_VALUES
        value += shares[k] * texelFetch(values, row).r;
#endif
    }
    for (uint k = 0u; k < 3u; ++k) own_normals[3u * pixel + k] = normal[k];
#if HAS_COLORS
    own_colors[pixel] = packUnorm4x8(vec4(to_srgb(color), 1.0));
#endif
#if HAS_VALUES
    own_values[pixel] = value;
#endif
}
