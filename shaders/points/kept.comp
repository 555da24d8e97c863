// Lists the rows that a picture shows. Of a square the pixel is taken that has neither to its left nor above it one of
// the same row: one of each square that is seen as a whole, few of others.
#include "common/item.glsl"
#include "common/list.glsl"

layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
uniform int width, pixel_count;

void main() {
    int first = int(item()) * RUN;
    int count = min(RUN, pixel_count - first);
    int x = first % width;
    uint taken = 0u, found = 0u;
    uint left = x > 0 ? texelFetch(rows, first - 1).r : NOTHING;
    for (int i = 0; i < count; ++i) {
        uint row = texelFetch(rows, first + i).r;
        uint above = first + i >= width ? texelFetch(rows, first + i - width).r : NOTHING;
        if (row != NOTHING && row != left && row != above) {
            taken |= 1u << i;
            ++found;
        }
        ++x;
        left = x < width ? row : NOTHING;
        x = x < width ? x : 0;
    }
    if (found == 0u) return;
    uint slot = reserve(found);
    for (int i = 0; i < count; ++i)
        if ((taken >> i & 1u) != 0u) list[slot++] = texelFetch(rows, first + i).r;
}
