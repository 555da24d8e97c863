// Lists points that are not near, and of whose splats something may be seen: of the blocks that such a splat may reach,
// one shows nothing somewhere, or nothing that is nearer by more than that.
#include "auto_splats/seen.glsl"
#include "auto_splats/block.glsl"

layout(binding = TEXTURE_SLOTS) uniform usamplerBuffer slots;
layout(binding = TEXTURE_FARTHEST) uniform usamplerBuffer farthest;  // depth bits, of each block
layout(binding = TEXTURE_USUAL) uniform samplerBuffer usual;

const float REACH = 0.4;  // of a splat, in usual radii

void main() {
    uint i = item();
    if (i >= item_count) return;
    uint row = texelFetch(slots, int(i)).w >> 1;
    vec2 pixel;
    float depth;
    if (!is_seen(row, pixel, depth) || is_near(pixel, depth)) return;
    float reach = REACH * texelFetch(usual, coarse_cell(pixel)).r, nearest = depth - reach / scale_at(depth);
    ivec2 shown = view_size - 2 * border;  // the picture without its border
    pixel -= float(border);
    ivec2 first = max(ivec2(pixel - reach), ivec2(0)) / BLOCK;
    ivec2 last = min(ivec2(pixel + reach), shown - 1) / BLOCK;
    bool is_late = false;
    for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x)
            is_late = is_late || uintBitsToFloat(texelFetch(farthest, y * blocks_of(shown).x + x).r) >= nearest;
    if (is_late) add(i, row);
}
