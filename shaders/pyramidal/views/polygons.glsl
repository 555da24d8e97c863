// Quads of neighbouring samples go to the pixels whose centres their triangles hold; a sample that is in no triangle of its
// own quad to the pixel that it lies in: those that are alone, and those along outlines to the right and below.
// CULL_BACK: what shows its back is left out.
#include <params>
#include "pyramidal/views/grid.glsl"
#include "range/rows.glsl"

void visit_point(RowOfSamples row, ivec2 uv, Corner a) {
    if (any(lessThan(a.pixel, vec2(0.0))) || any(greaterThanEqual(a.pixel, vec2(view_size)))) return;
#if CULL_BACK
    if (shows_back(row.view, row.level, uv, a)) return;
#endif
    ivec2 at = ivec2(a.pixel);
    visit(uint(at.y * view_size.x + at.x), floatBitsToUint(-a.place.z), item_of(a.index, ALONE));
}

// part: of the picture's rows that is drawn, from 1 on; 0: all.
void visit_triangle(Corner x, Corner y, Corner z, float front, uint own, int part) {
    vec2 low = min(x.pixel, min(y.pixel, z.pixel)), high = max(x.pixel, max(y.pixel, z.pixel));
    ivec2 first = max(ivec2(ceil(low - 0.5)), ivec2(0)), last = min(ivec2(floor(high - 0.5)), view_size - 1);
#if CULL_BACK
    if (beside(x.pixel, y.pixel, z.pixel) * front < 0.0) return;
#endif
    int every = part == 0 ? 1 : parts;
    if (part > 0) first.y += (part - 1 + parts - first.y % parts) % parts;
    for (int row = first.y; row <= last.y; row += every)
        for (int column = first.x; column <= last.x; ++column) {
            vec3 shares = shares_at(x, y, z, vec2(column, row) + 0.5);
            if (!is_inside(shares)) continue;
            uint key = floatBitsToUint(depth_at(depths_of(x, y, z), shares));
            visit(uint(row * view_size.x + column), key, own);
        }
}

void scatter(uint i) {
    RowOfSamples row;
    if (!row_of_samples(i, row)) return;
    ivec2 uv = row.first;
    Corner a = corner_at(row.view, row.range, row.level, uv), c = corner_at(row.view, row.range, row.level, uv + ivec2(0, 1));
    for (; uv.x < row.last.x; ++uv.x) {
        Corner b = corner_at(row.view, row.range, row.level, uv + ivec2(1, 0));
        Corner d = corner_at(row.view, row.range, row.level, uv + ivec2(1, 1));
        int drawn = triangles(row.view, row.level, a, b, c, d);
        if ((drawn & 1) != 0) visit_triangle(b, c, d, -1.0, item_of(a.index, 0u), row.part);
        if ((drawn & 2) != 0) visit_triangle(a, c, d, -1.0, item_of(a.index, 1u), row.part);
        if ((drawn & 4) != 0) visit_triangle(a, b, d, 1.0, item_of(a.index, 2u), row.part);
        if ((drawn & 8) != 0) visit_triangle(a, b, c, 1.0, item_of(a.index, 3u), row.part);
        if ((drawn & ~1) == 0 && a.there) visit_point(row, uv, a);
        a = b;
        c = d;
    }
}
