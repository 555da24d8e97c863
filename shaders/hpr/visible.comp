// Marks points that are visible. MARK 0: those in no sector, since nothing is known that hides them; MARK 1: the
// sectors' candidates. SAMPLED: a list says which points there are.
#include "common/item.glsl"

layout(std430, binding = STORAGE_VISIBLE) buffer Visible { uint visible[]; };
#if MARK
layout(binding = TEXTURE_BEST) uniform usamplerBuffer rows;
#else
#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;
#endif
layout(binding = TEXTURE_HOMES) uniform usamplerBuffer homes;
#endif

void main() {
    uint i = item();
    if (i >= item_count) return;
#if MARK
    uint row = texelFetch(rows, int(i)).r;
    if (row != NOTHING) visible[row] = 1u;
#else
    if (texelFetch(homes, int(i)).rg != uvec2(NOTHING, 0u)) return;
#if SAMPLED
    i = texelFetch(drawn_rows, int(i)).r;
#endif
    visible[i] = 1u;
#endif
}
