// The finest level of what is pulled and pushed: what pixels show of the points. A depth, up to which depth others are of
// the same surface, how many pixels its splat reaches, and the level, 0; normal and value; linear colour.
#include "common/view.glsl"
#include "common/item.glsl"
#include "common/color.glsl"
#include "amplify/packed.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
layout(binding = TEXTURE_SPLATS) uniform usamplerBuffer splats;
#if HAS_COLORS
layout(binding = TEXTURE_COLORS) uniform samplerBuffer colors;
layout(std430, binding = STORAGE_COLOR_SAMPLES) writeonly buffer ColorSamples { float color_samples[]; };
#endif
#if HAS_VALUES
layout(binding = TEXTURE_VALUES) uniform samplerBuffer values;
#endif
layout(std430, binding = STORAGE_SAMPLES) writeonly buffer Samples { vec4 samples[]; };
layout(std430, binding = STORAGE_WEIGHTS) writeonly buffer Weights { float weights[]; };
layout(std430, binding = STORAGE_LOOK_SAMPLES) writeonly buffer LookSamples { vec4 look_samples[]; };

const float STEEPEST_TANGENT = 4.0;  // of the angle between a surface and the picture, as far as its depths may spread
const float SIDES = 3.0;             // radii over which the surface is looked for

void main() {
    uint i = item();
    if (i >= item_count) return;
    uint row = texelFetch(rows, int(i)).r;
    if (row == NOTHING) {
        weights[i] = 0.0;
        return;
    }
    float depth = uintBitsToFloat(texelFetch(depths, int(i)).r);
    uvec3 splat = texelFetch(splats, int(row)).xyz;
    vec3 normal = packed_normal(splat), view = to_view(texelFetch(positions, int(row)).xyz);
    vec3 to_eye = view_perspective ? normalize(-view) : vec3(0.0, 0.0, 1.0);
    float facing = abs(dot(mat3(world_to_view) * normal, to_eye));
    float slope = min(sqrt(1.0 - min(facing * facing, 1.0)) / max(facing, 1e-3), STEEPEST_TANGENT);
    float radius = packed_radius(splat);
    float value = 0.0;
#if HAS_VALUES
    value = texelFetch(values, int(row)).r;
#endif
    samples[i] = vec4(depth, depth + radius * (1.0 + SIDES * slope), radius * scale_at(depth), 0.0);
    look_samples[i] = vec4(normal, value);
    weights[i] = 1.0;
#if HAS_COLORS
    vec3 color = to_linear(texelFetch(colors, int(row)).rgb);
    for (uint k = 0u; k < 3u; ++k) color_samples[3u * i + k] = color[k];
#endif
}
