// Samples that are points of a cloud. COLOR, NORMAL, VALUE: what is asked of them.

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
#if COLOR
layout(binding = TEXTURE_COLORS) uniform samplerBuffer colors;
#endif
#if NORMAL
layout(binding = TEXTURE_NORMALS) uniform samplerBuffer normals;
#endif
#if VALUE
layout(binding = TEXTURE_VALUES) uniform samplerBuffer values;
#endif

vec3 place_of(uint row) { return to_view(texelFetch(positions, int(row)).xyz); }

// Points have no neighbours that are known.
bool are_neighbors(uint row, uint other, int most) { return false; }

void own_pixel(ivec2 pixel, uint item_index, inout float depth, out uint row, out Seen seen) {
    row = item_index;
    seen = UNSEEN;
#if COLOR
    seen.color = to_linear(texelFetch(colors, int(row)).rgb);
#endif
#if NORMAL
    vec3 normal = texelFetch(normals, int(row)).xyz;
    float size = length(normal);
    seen.normal = size > 0.0 && size < UNKNOWN ? normal / size : vec3(0.0);
#endif
#if VALUE
    seen.value = texelFetch(values, int(row)).r;
#endif
}
