// Lists the cells of the coarsest target in which pixels may be filled: those that have empty ones, and something around
// them. Each is listed once for each of its pixels.
#include "common/item.glsl"
#include "common/list.glsl"
#include "common/split.glsl"
#include <params>
#include "pyramidal/around.glsl"
#include "pyramidal/seen.glsl"

layout(binding = TEXTURE_SHOWN) uniform usamplerBuffer shown;

void main() {
    int i = int(item());
    ivec2 size = target_size(view_size, coarsest), cell = split(i, size.x);
    if (i >= size.x * size.y) return;
    int edge = 1 << coarsest;
    ivec2 pixels = min(edge * (cell + 1), view_size) - edge * cell;
    uint filled = count_filled(texelFetch(shown, target_start(view_size, coarsest) + i));
    bool full = density == 0 && int(filled) == pixels.x * pixels.y && (levels & 1) != 0;
    bool nothing = isinf(depths_around(window_of(coarsest, edge * cell, 1)).x);
    if (full || nothing) return;
    uint each = uint(edge * edge);
    list[reserve(each) / each] = uint(i);
}
