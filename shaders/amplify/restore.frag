// What the Surface holds, for the rasteriser to draw over.
#include "common/view.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;

layout(location = 0) out uint out_row;
layout(location = 1) out float out_depth;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    int index = pixel.y * view_size.x + pixel.x;
    out_row = texelFetch(rows, index).r;
    out_depth = uintBitsToFloat(texelFetch(depths, index).r);
    gl_FragDepth = out_row == NOTHING ? 0.0 : stored_depth(out_depth);
}
