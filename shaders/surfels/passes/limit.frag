// The depth buffer of the second pass: what the first one found, pushed away from the eye.
// Filled pixels have a negative depth.
#include "surfels/passes/limit.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    int index = pixel.y * view_size.x + pixel.x;
    uint row = texelFetch(rows, index).r;
    gl_FragDepth = row == NOTHING ? 1.0 : limit_behind(abs(uintBitsToFloat(texelFetch(depths, index).r)), row);
}
