// The radius, in pixels, that most neighborhoods are within, for each coarse cell: some times that of pi r^2 = A k /
// n (Preiner 2012, 5.1), of the smallest region around the cell that has enough participants to tell, or of the
// picture.
#include "common/item.glsl"
#include "common/split.glsl"
#include "auto_splats/place.glsl"

layout(binding = TEXTURE_COUNTS) uniform usamplerBuffer counts;
layout(std430, binding = STORAGE_USUAL) writeonly buffer Usual { float usual[]; };
layout(std430, binding = STORAGE_TOTALS) buffer Totals { uint occupied, crowd; };  // most in a cell

// Surfaces are slanted, lie behind each other, and have clusters of points: nine in ten radii are within.
const float WIDE = 2.5;
const float MOST = 4.0;  // of the radius that is typical for the picture: strays are not usual where nothing else is
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
    float evenly = sqrt(area * float(K) / (3.14159265 * float(max(count, 1u))));
    usual[i] = WIDE * min(evenly, MOST * typical);
}
