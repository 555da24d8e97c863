// The depth buffer of the second pass: what the first one found, pushed away from the eye.
// Filled pixels have a negative depth.
#include "surfels/passes/limit.glsl"
#if LOCAL
#include "surfels/passes/look.glsl"
#endif

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    int index = pixel.y * view_size.x + pixel.x;
    uint row = texelFetch(rows, index).r;
    float depth = abs(uintBitsToFloat(texelFetch(depths, index).r));
#if LOCAL
    vec3 normal = row == NOTHING ? vec3(0.0) : normal_of(texelFetch(looks, int(row)).xy);
    precise float behind = depth + max(epsilon * visible_radius(depth, row), layer_depth(normal, vec2(pixel) + 0.5));
    float limit = stored_depth(behind);
#else
    float limit = limit_behind(depth, row);
#endif
    gl_FragDepth = row == NOTHING ? 1.0 : limit;
}
