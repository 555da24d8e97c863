// The radius, in pixels, that is expected to hold k participants, for each coarse cell: pi r^2 = A k / n
// (Preiner 2012, 5.1), of the smallest region around the cell that has enough of them to tell.
#include "common/item.glsl"
#include "common/split.glsl"
#include "auto_splats/place.glsl"

layout(binding = TEXTURE_COUNTS) uniform usamplerBuffer counts;
layout(std430, binding = STORAGE_USUAL) writeonly buffer Usual { float usual[]; };
layout(std430, binding = STORAGE_TOTALS) buffer Totals { uint occupied, crowd; };  // most in a cell

const int REGIONS = 4;  // of the cell, and 3, 7, 15 times its side

void main() {
    uint i = item();
    if (i >= item_count) return;
    ivec2 cell = split(int(i), coarse_size.x);
    uint count = 0u;
    int cells = 0;
    for (int region = 0; region < REGIONS; ++region) {
        int reach = (1 << region) - 1;
        ivec2 first = max(cell - reach, 0), last = min(cell + reach, coarse_size - 1);
        count = 0u;
        for (int y = first.y; y <= last.y; ++y)
            for (int x = first.x; x <= last.x; ++x) count += texelFetch(counts, y * coarse_size.x + x).r;
        cells = (last.x - first.x + 1) * (last.y - first.y + 1);
        if (region == 0 && count > crowd) atomicMax(crowd, count);
        if (count >= ENOUGH) break;
    }
    float area = float(cells << 2 * coarse_shift);
    usual[i] = sqrt(area * float(K) / (3.14159265 * float(max(count, 1u))));
}
