// Splats of noisy points: planes through all participants within a ball that is wider than the neighborhood, nearer
// ones with more weight (moving least squares, Levin 2003), in place of planes through the neighborhood. The centre of a
// splat moves along the normal onto the surface that these participants tell.
//
// Sums are of whole numbers: they do not depend on the order of participants in their cells.
#include "common/item.glsl"
#include "auto_splats/ball.glsl"
#include "auto_splats/eigen.glsl"
#include "auto_splats/splat.glsl"
#include "amplify/packed.glsl"

layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;  // slots of those that are searched
layout(std430, binding = STORAGE_EXTENTS) readonly buffer Extents { float extents[]; };
layout(std430, binding = STORAGE_NEXT) readonly buffer Next { float next[]; };  // below 0: lines.comp finds the plane
layout(std430, binding = STORAGE_PLACES) writeonly buffer Places { float places[]; };  // of splats, by row
uniform uint first;
uniform float widening;  // radii of the neighborhood that the ball reaches

const float STEPS = 131072.0;  // of whole numbers to 1: sums of 16 000 points fit
const float COLLINEAR = 1e-4;  // of the largest eigenvalue, below which the second makes no plane
// The share of the bend that counts. Without it, the mean of a ball lies inside of round bodies; with all of it, noise
// counts nearly twice as much.
const float BENT = 0.6;
const float BENDING = 0.005;  // least determinant, over the squared sum of weights: participants tell how the surface bends
const float GROWTH = 0.15;  // of a splat's radius, for a ball of twice the neighborhood's radius

float scale;  // one over the ball's radius
int weights, fourths;
ivec3 sum, squares, products, thirds;

void take(vec3 offset, uint row) {
    vec3 away = offset * scale;
    float weight = STEPS * (1.0 - dot(away, away));
    if (weight <= 0.0) return;
    vec3 weighted = weight * away;
    weights += int(weight);
    sum += ivec3(weighted);
    squares += ivec3(weighted * away);
    products += ivec3(weighted.yzx * away.zxy);
    thirds += ivec3(dot(away, away) * weighted);
    fourths += int(dot(weighted, away) * dot(away, away));
}

// How far the surface lies above the point, along the normal: as the mean of participants, or, with BENT, as heights are
// that grow with the squared distance. total: of weighted offsets; mean: of offsets, all in radii of the ball. bend: what
// heights grow by over that square; 0: unknown.
float height(vec3 total, vec3 mean, vec3 normal, out float bend) {
    bend = 0.0;
    float level = dot(mean, normal), count = float(weights) / STEPS;
    float second = float(squares.x + squares.y + squares.z) / STEPS, fourth = float(fourths) / STEPS;
    float determinant = count * fourth - second * second;
    if (determinant < BENDING * count * count) return level;
    bend = (count * dot(vec3(thirds), normal) / STEPS - second * dot(total, normal)) / determinant;
    float bent = (fourth * dot(total, normal) - second * dot(vec3(thirds), normal) / STEPS) / determinant;
    return mix(level, bent, BENT);
}

void put(uint row, vec3 place) {
    for (uint k = 0u; k < 3u; ++k) places[3u * row + k] = place[k];
}

void main() {
    uint i = item();
    if (i >= item_count) return;
    uint n = first + i;
    uvec4 slot = texelFetch(slots, int(texelFetch(listed, int(n)).r));
    uint row = slot.w >> 1;
    vec3 position = texelFetch(positions, int(row)).xyz;
    put(row, position);
    float radius = widening * extents[3u * row];
    if (next[n] < 0.0 || !(radius * unit > 0.0)) return;
    scale = 1.0 / (radius * unit);
    weights = 0;
    sum = squares = products = thirds = ivec3(0);
    fourths = 0;
    center = to_view(position);
    take_from(cells_of(radius), uintBitsToFloat(slot.xyz), 0);
    vec3 total = vec3(sum) / STEPS, mean = total * STEPS / float(max(weights, 1));
    mat3 vectors;
    vec3 values = eigen(vec3(squares) / STEPS - total * mean, vec3(products) / STEPS - total.yzx * mean.zxy, vectors);
    if (values.y <= COLLINEAR * values.z) return;
    vec3 normal = vectors[0];
    if (dot(normal, seen_from(row)) < 0.0) normal = -normal;
    float bend, above = height(total, mean, normal, bend) * radius;
    // Noise moves splats off each other, so that they would leave gaps where they are seen from the side.
    float grown = (1.0 + GROWTH * (widening - 1.0)) * uintBitsToFloat(splats[3u * row + 1u]), shift = 0.0;
    float roundness = ELLIPTICAL ? max(values.y, 0.0) / values.z : 1.0;
    vec3 longer = vectors[2];
#if CUT
    // What search.comp cut; or more, where the surface, which is taken to bend alike in all directions, is seen to end.
    uvec3 words = uvec3(splats[3u * row], splats[3u * row + 1u], splats[3u * row + 2u]);
    roundness = unpackUnorm2x16(words.z).y;
    longer = normalize(cross(normal, cross(packed_longer(words), normal)));
    shift = extents[3u * row + 2u];
    vec3 to_eye = normalize(seen_from(row)), along = to_eye - dot(to_eye, normal) * normal;
    float slant = length(along), end = 0.25 * dot(to_eye, normal) / max(slant * abs(bend), 1e-9) * radius;
    float whole = grown / roundness;
    if (end < (2.0 * roundness - 1.0) * whole) {
        grown = whole;
        shift = cut(normal, sign(bend) * along / slant, end, 1.0 / scale_at(-center.z), grown, longer, roundness);
    }
#endif
    put(row, position + above * normal + shift * cross(longer, normal));
    splats[3u * row] = packSnorm2x16(folded(normal));
    splats[3u * row + 1u] = floatBitsToUint(grown);  // 0 stays: of outliers
    splats[3u * row + 2u] = pack_axes(normal, longer, roundness);
    looks[2u * row + 1u] = pack_normal(normal);
}
