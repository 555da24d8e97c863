// Lists points that are not near, and of whose splats something may be seen: their pixel, or one that such a splat may
// reach, shows nothing, or nothing that is nearer by more than `reach`. Pixels in a spiral, as gaps may be small.
#include "auto_splats/seen.glsl"

layout(binding = TEXTURE_SLOTS) uniform usamplerBuffer slots;
layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_USUAL) uniform samplerBuffer usual;

const float REACH = 0.4;  // usual radii; splats may be half as large again
const int AROUND = 32;

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
    bool is_late = lets_through(pixel, nearest);
    for (int i = 0; i < AROUND; ++i) {
        float angle = 2.3999632 * float(i), distance = 1.5 * reach * sqrt((float(i) + 0.5) / float(AROUND));
        is_late = is_late || lets_through(pixel + distance * vec2(cos(angle), sin(angle)), nearest);
    }
    if (is_late) add(i, row);
}
