// Samples of range views. CULL_BACK: those whose surface shows its back are left out.
#include "common/color.glsl"
#include <params>
#include "pyramidal/views/grid.glsl"
#include "range/rows.glsl"
#if SUMS

vec3 color_of_item(uint item_id) { return to_linear(sample_look(int(item_id / PARTS)).rgb); }
#endif
#include "pyramidal/placing.glsl"

void scatter(uint i) {
    RowOfSamples row;
    if (!row_of_samples(i, row)) return;
    for (ivec2 uv = row.first; uv.x < row.last.x; ++uv.x) {
        Corner a = corner_at(row.view, row.range, row.level, uv);
        if (!a.there) continue;
#if CULL_BACK
        if (shows_back(row.view, row.level, uv, a)) continue;
#endif
        place_sample(a.pixel, -a.place.z, item_of(a.index, ALONE));
    }
}
