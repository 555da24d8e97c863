// The normal of the face that a pixel shows, for flat shading: the axis along which the seen place is farthest
// from its voxel's centre.
#include "common/view.glsl"
#include "common/item.glsl"
#include "common/list.glsl"

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
layout(std430, binding = STORAGE_NORMAL) writeonly buffer Normal { float own_normals[]; };

void main() {
    uint i = item();
    if (i >= list_count) return;
    int index = int(list[i]);
    float depth = uintBitsToFloat(texelFetch(depths, index).r);
    vec2 pixel = vec2(index % view_size.x, index / view_size.x) + 0.5;
    vec3 center = to_view(texelFetch(positions, int(texelFetch(rows, index).r)).xyz);
    vec3 off = transpose(mat3(world_to_view)) * (from_pixel(pixel, depth) - center);
    vec3 size = abs(off);
    int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    for (int k = 0; k < 3; ++k) own_normals[3 * index + k] = k == axis ? sign(off[k]) : 0.0;
}
