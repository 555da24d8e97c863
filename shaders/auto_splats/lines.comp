// Splats of points that are dense along a line and sparse across, as along a ring of a scanner that turns: all of the
// nearest are on one line, and tell neither how the surface lies nor how far the next line is. The nearest participant
// beside the line is looked for, and the nearest opposite; the plane goes through these, and the splat reaches halfway.
#include "common/item.glsl"
#include "common/list.glsl"
#include "auto_splats/ball.glsl"
#include "auto_splats/splat.glsl"
#include "amplify/packed.glsl"

layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;  // slots of those that are searched
layout(std430, binding = STORAGE_EXTENTS) readonly buffer Extents { float extents[]; };
layout(std430, binding = STORAGE_NEXT) buffer Next { float next[]; };  // as search.comp has it; made 0: done

const float APART = 0.4;  // radii of the neighborhood that what is beside is away at least, else it is noise
const float OPPOSITE = -0.5;  // cosine of the least angle between both sides
const float BALLS = 2.0;  // times as large is the second ball that is searched

vec3 along, one;  // of the line, and from it to what is beside; 0 where that is looked for
float least, near_squared;
uint near_row;

// The nearest that is rather beside than along, and opposite to what is known already.
void take(vec3 offset, uint row) {
    precise float squared = offset.x * offset.x + offset.y * offset.y;
    squared = squared + offset.z * offset.z;
    float ahead = dot(offset, along), across = squared - ahead * ahead, turned = dot(offset, one);
    bool beside = squared > least && across > ahead * ahead;
    bool opposite = turned <= 0.0 && turned * turned >= OPPOSITE * OPPOSITE * across * dot(one, one);
    if (!beside || !opposite || squared > near_squared || (squared == near_squared && row > near_row)) return;
    near_squared = squared;
    near_row = row;
}

// From the line to the nearest within a ball; 0 where there is none. reach: scan units.
vec3 nearest_beside(vec3 place, float reach) {
    vec3 found = vec3(0.0);
    for (float ball = reach / BALLS; ball <= reach && found == vec3(0.0); ball *= BALLS) {
        near_squared = ball * unit * ball * unit;
        near_row = NOTHING;
        take_from(cells_of(ball), place, 0);
        if (near_row != NOTHING) {
            found = texelFetch(positions, int(near_row >> 1)).xyz * unit - place;
            found -= dot(found, along) * along;
        }
    }
    return found;
}

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint n = list[i];
    uvec4 slot = texelFetch(slots, int(texelFetch(listed, int(n)).r));
    uint row = slot.w >> 1;
    vec3 place = uintBitsToFloat(slot.xyz);
    uvec3 words = uvec3(splats[3u * row], splats[3u * row + 1u], splats[3u * row + 2u]);
    along = packed_longer(words);
    least = APART * extents[3u * row] * unit;
    least *= least;
    center = to_view(texelFetch(positions, int(row)).xyz);
    float reach = -next[n];
    next[n] = 0.0;
    one = vec3(0.0);
    one = nearest_beside(place, reach);
    if (one == vec3(0.0)) return;
    vec3 other = nearest_beside(place, reach);
    vec3 normal = normalize(cross(along, one - other));
    if (dot(normal, seen_from(row)) < 0.0) normal = -normal;
    float longer = 0.5 * LEANING * max(length(one), length(other)) / unit;
    float shorter = max(packed_radius(words), LEAST_ROUND * longer);
    splats[3u * row] = packSnorm2x16(folded(normal));
    splats[3u * row + 1u] = floatBitsToUint(shorter);
    splats[3u * row + 2u] = pack_axes(normal, cross(normal, along), min(shorter / longer, 1.0));
    looks[2u * row + 1u] = pack_normal(normal);
}
