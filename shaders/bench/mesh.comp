// What each covered pixel sees of its face: normal and colour, interpolated between the corners
// by where the ray through the pixel's centre meets the face's plane.
#include "common/view.glsl"
#include "common/color.glsl"
#include "common/item.glsl"
#include "common/list.glsl"

layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;       // of faces
layout(binding = TEXTURE_CORNERS) uniform usamplerBuffer corners;    // three vertices a face
layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
layout(binding = TEXTURE_NORMALS) uniform samplerBuffer normals;
layout(binding = TEXTURE_COLORS) uniform samplerBuffer colors;
layout(std430, binding = STORAGE_NORMAL) writeonly buffer Normal { float own_normals[]; };
layout(std430, binding = STORAGE_COLOR) writeonly buffer Color { uint own_colors[]; };

// Barycentric coordinates of the ray through the triangle: volumes that it spans with each edge.
vec3 weights(vec3 a, vec3 b, vec3 c, vec2 pixel) {
    vec3 ray = from_pixel(pixel, 1.0);
    if (!view_perspective) a.z = b.z = c.z = -1.0;  // parallel rays: only x and y count
    vec3 volumes = vec3(dot(ray, cross(b, c)), dot(ray, cross(c, a)), dot(ray, cross(a, b)));
    return volumes / (volumes.x + volumes.y + volumes.z);
}

vec3 linear_color(int vertex) {
    return to_linear(texelFetch(colors, vertex).rgb);
}

void main() {
    uint i = item();
    if (i >= list_count) return;
    int index = int(list[i]);
    int face = int(texelFetch(rows, index).r);
    ivec3 corner = ivec3(texelFetch(corners, 3 * face).r, texelFetch(corners, 3 * face + 1).r,
                         texelFetch(corners, 3 * face + 2).r);
    vec3 a = to_view(texelFetch(positions, corner.x).xyz);
    vec3 b = to_view(texelFetch(positions, corner.y).xyz);
    vec3 c = to_view(texelFetch(positions, corner.z).xyz);
    vec3 w = weights(a, b, c, vec2(index % view_size.x, index / view_size.x) + 0.5);

    vec3 normal = w.x * texelFetch(normals, corner.x).xyz + w.y * texelFetch(normals, corner.y).xyz
                + w.z * texelFetch(normals, corner.z).xyz;
    for (int k = 0; k < 3; ++k) own_normals[3 * index + k] = normal[k];
#if HAS_COLORS
    vec3 color = w.x * linear_color(corner.x) + w.y * linear_color(corner.y) + w.z * linear_color(corner.z);
    own_colors[index] = packUnorm4x8(vec4(to_srgb(color), 1.0));
#endif
}
