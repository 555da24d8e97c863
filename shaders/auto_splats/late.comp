// Lists the slots of points that are not active, and not behind what their pixels show by more than a usual
// radius.
#include "auto_splats/seen.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_USUAL) uniform samplerBuffer usual;

void main() {
    uint i = item(), row;
    vec2 pixel;
    float depth;
    if (i >= item_count || !is_seen(i, pixel, depth, row) || is_active(pixel, depth)) return;
    float shown = uintBitsToFloat(texelFetch(depths, pixel_number(pixel)).r);
    if (depth <= shown + texelFetch(usual, coarse_cell(pixel)).r / scale_at(depth)) add(i, row);
}
