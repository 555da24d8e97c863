// Lists points that are not active, and not behind what their pixels show by more than a usual radius, or by a gap.
#include "auto_splats/seen.glsl"

layout(binding = TEXTURE_SLOTS) uniform usamplerBuffer slots;
layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_USUAL) uniform samplerBuffer usual;

// Whether a gap is near, which a splat of that reach may close.
bool is_by_gap(vec2 pixel, float reach) {
    bool found = false;
    for (int i = 0; i < 8; ++i) {
        float angle = 0.7853982 * float(i);
        vec2 at = pixel + (i % 2 == 0 ? reach : 0.5 * reach) * vec2(cos(angle), sin(angle));
        found = found || (in_picture(at) && texelFetch(depths, pixel_number(at)).r == NO_DEPTH);
    }
    return found;
}

void main() {
    uint i = item();
    if (i >= item_count) return;
    uint row = texelFetch(slots, int(i)).w;
    vec2 pixel;
    float depth;
    if (!is_seen(row, pixel, depth) || is_active(pixel, depth)) return;
    float shown = uintBitsToFloat(texelFetch(depths, pixel_number(pixel)).r);
    float radius = texelFetch(usual, coarse_cell(pixel)).r;
    if (depth <= shown + radius / scale_at(depth) || is_by_gap(pixel, 0.6 * radius)) add(i, row);
}
