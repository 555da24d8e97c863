// Lists points that are not near, and of whose splats something may be seen: a pixel as far away as such a splat
// reaches shows nothing, or nothing that is nearer by more than that.
#include "auto_splats/seen.glsl"

layout(binding = TEXTURE_SLOTS) uniform usamplerBuffer slots;
layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_USUAL) uniform samplerBuffer usual;

const float REACH = 0.4;  // of a splat, in usual radii

bool lets_through(vec2 pixel, float depth) {
    return in_picture(pixel) && uintBitsToFloat(texelFetch(depths, pixel_number(pixel)).r) >= depth;
}

void main() {
    uint i = item();
    if (i >= item_count) return;
    uint row = texelFetch(slots, int(i)).w >> 1;
    vec2 pixel;
    float depth;
    if (!is_seen(row, pixel, depth) || is_near(pixel, depth)) return;
    float reach = REACH * texelFetch(usual, coarse_cell(pixel)).r, nearest = depth - reach / scale_at(depth);
    bool is_late = false;
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) is_late = is_late || lets_through(pixel + reach * vec2(x, y), nearest);
    if (is_late) add(i, row);
}
