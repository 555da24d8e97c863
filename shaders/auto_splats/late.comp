// Lists points that are not active, and not behind what their pixels show by more than a usual radius.
#include "auto_splats/seen.glsl"

layout(binding = TEXTURE_SLOTS) uniform usamplerBuffer slots;
layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_USUAL) uniform samplerBuffer usual;

void main() {
    uint i = item();
    if (i >= item_count) return;
    uint row = texelFetch(slots, int(i)).w;
    vec2 pixel;
    float depth;
    if (!is_seen(row, pixel, depth) || is_active(pixel, depth)) return;
    float shown = uintBitsToFloat(texelFetch(depths, pixel_number(pixel)).r);
    if (depth <= shown + texelFetch(usual, coarse_cell(pixel)).r / scale_at(depth)) add(i, row);
}
