// The splat of each candidate, of what was added up around it and how far its sectors pass it at most. Other points have
// none: a radius of 0.
#include "common/view.glsl"
#include "common/item.glsl"
#include "common/color.glsl"
#include "amplify/packed.glsl"
#include "hpr/extents.glsl"
#if STEADY
#include "hpr/steady.glsl"
#endif

layout(binding = TEXTURE_SUMS) uniform isamplerBuffer sums;  // as hpr/circulation.glsl adds them
layout(binding = TEXTURE_KEYS) uniform usamplerBuffer keys;  // as hpr/sizes.glsl has them; NO_DEPTH: no candidate
layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
layout(binding = TEXTURE_SPACINGS) uniform samplerBuffer apart;  // distance between points around each, in space
#if HAS_COLORS
layout(binding = TEXTURE_COLORS) uniform samplerBuffer colors;
#endif
layout(std430, binding = STORAGE_SPLATS) writeonly buffer Splats { uint splats[]; };  // as amplify/packed.glsl reads
layout(std430, binding = STORAGE_LOOKS) writeonly buffer Looks { uint looks[]; };  // as surfels/passes/look.glsl reads
layout(std430, binding = STORAGE_SPACINGS) writeonly buffer Spacings { float spacings[]; };

const float steps[] = STEPS;
const float LEANING = 1.0;  // spacings that a splat reaches, since it may lean, but not far beyond its sectors
const float LEAST_FACING = 0.5;  // cosine, below which leaning adds no more to a splat: normals at outlines are uncertain
// In distances between points in space: from which reach on a point is one of an outline, whose sectors lie outside; what
// its splat reaches at most; and what other splats reach at least, so that none leaves a gap.
const float OUTLINE = 1.4, AT_OUTLINE = 1.1, CLOSED = 1.0;
const float FEW = 3.0;  // distances between neighbors in sectors that this is at most: few points tell none in space
const float OUTSIDE = 1.5;   // spacings that it reaches at most: candidates at outlines have sectors far outside

void main() {
    uint row = item();
    if (row >= item_count) return;
    float numbers[CHANNELS];
    for (uint k = 0u; k < CHANNELS; ++k) numbers[k] = float(texelFetch(sums, int(CHANNELS * row + k)).r) * steps[k];
    float width = sector_width(spot_of(row));
    float spacing = width * (numbers[4] > 0.0 ? numbers[3] / numbers[4] : 1.0);
    uint key = texelFetch(keys, int(row)).r;
    float reach = uintBitsToFloat(NO_DEPTH - 1u - key) + 0.5 * width;
    vec3 to_eye = view_perspective ? -to_view(texelFetch(positions, int(row)).xyz) : vec3(0.0, 0.0, 1.0);
    to_eye = normalize(to_eye * mat3(world_to_view));
    vec3 normal = vec3(numbers[0], numbers[1], numbers[2]);
#if STEADY
    vec3 steady = steady_normal(texelFetch(positions, int(row)).w);
    if (steady != vec3(0.0)) normal = dot(steady, to_eye) < 0.0 ? -steady : steady;
#endif
    normal = normal == vec3(0.0) ? to_eye : normalize(normal);
    float leaning = reach / max(dot(normal, to_eye), LEAST_FACING);
    float radius = min(max(leaning, min(LEANING * spacing, 3.0 * reach)), OUTSIDE * spacing);
    float around = max(texelFetch(apart, int(row)).r, width);  // where sectors are wider, candidates are a sector apart
    float least = min(CLOSED * around, FEW * spacing);
    radius = reach > OUTLINE * around ? min(radius, AT_OUTLINE * around) : max(radius, least);
    splats[3u * row] = packSnorm2x16(folded(normal));
    splats[3u * row + 1u] = key == NO_DEPTH ? 0u : floatBitsToUint(radius);
    splats[3u * row + 2u] = ROUND << 16;
    spacings[row] = spacing;
#if HAS_COLORS
    uvec3 roots = uvec3(to_roots(texelFetch(colors, int(row)).rgb));
    looks[2u * row] = roots.x | roots.y << 10 | roots.z << 20;
#endif
    looks[2u * row + 1u] = pack_normal(normal);
}
