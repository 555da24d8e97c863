// Samples go to the pixels that they lie in. CULL_BACK: those whose surface shows its back are left out.
#include <params>
#include "pyramidal/views/grid.glsl"
#include "range/rows.glsl"

void scatter(uint i) {
    RowOfSamples row;
    if (!row_of_samples(i, row)) return;
    for (ivec2 uv = row.first; uv.x < row.last.x; ++uv.x) {
        Corner a = corner_at(row.view, row.range, row.level, uv);
        if (!a.there) continue;
        if (any(lessThan(a.pixel, vec2(0.0))) || any(greaterThanEqual(a.pixel, vec2(view_size)))) continue;
#if CULL_BACK
        if (dot(sample_normal(row.view, row.level, uv), view_perspective ? a.place : vec3(0.0, 0.0, -1.0)) > 0.0) continue;
#endif
        ivec2 at = ivec2(a.pixel);
        visit(uint(at.y * view_size.x + at.x), floatBitsToUint(-a.place.z), item_of(a.index, ALONE));
    }
}
