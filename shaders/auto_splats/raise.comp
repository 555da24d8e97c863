// Moves the middles of splats onto the surface. A disc at a point of a round body lies outside of it but for the point, and
// the neighbors lie below: the middle comes nearer to their mean.
#include "common/item.glsl"
#include "amplify/packed.glsl"

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn;
layout(std430, binding = STORAGE_SPLATS) buffer Splats { uint splats[]; };  // as amplify/packed.glsl reads
layout(std430, binding = STORAGE_EXTENTS) readonly buffer Extents { float extents[]; };  // as auto_splats/fit.glsl has them
layout(std430, binding = STORAGE_PLACES) writeonly buffer Places { float places[]; };  // of splats, by row
uniform uint first;

const float RAISED = 0.9, MOST_RAISED = 0.2;  // of the mean's height; of the splat's radius
const float WIDER = 0.3;  // of the height: what the radius grows by, as splats lie farther apart

void main() {
    uint i = item();
    if (i >= item_count) return;
    uint row = texelFetch(drawn, int(first + i)).r;
    uvec3 words = uvec3(splats[3u * row], splats[3u * row + 1u], splats[3u * row + 2u]);
    float radius = packed_radius(words), most = MOST_RAISED * radius;
    float height = clamp(RAISED * extents[3u * row + 1u], -most, most);
    vec3 normal = packed_normal(words), shorter = cross(packed_longer(words), normal);
    vec3 place = texelFetch(positions, int(row)).xyz + height * normal + extents[3u * row + 2u] * shorter;
    for (uint k = 0u; k < 3u; ++k) places[3u * row + k] = place[k];
    splats[3u * row + 1u] = floatBitsToUint(radius + WIDER * abs(height));
}
