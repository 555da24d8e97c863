// The cells of a listed point: its own, or, DISCS, those that its disc reaches on any face. SAMPLED: a list says which
// points there are.
#include "common/list.glsl"
#include "hpr/sights.glsl"

#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;
#endif
#if DISCS
layout(binding = TEXTURE_SIGHTS) uniform samplerBuffer sights;
#else
layout(binding = TEXTURE_SPOTS) uniform samplerBuffer spots;
#endif

#if DISCS
ivec2 cell_of(vec2 tangents) {
    return ivec2(floor((angles_of(tangents) / half_angle + 1.0) * (0.5 * float(edge))));
}

void visit_disc(uint row, vec3 at, float reach, int face) {
    float wide = length(at.xy) + reach;
    float stretched = reach * (1.0 + tangent * tangent * wide * wide);
    ivec2 first = max(cell_of(max(at.xy - stretched, vec2(-1.0))), ivec2(0));
    ivec2 last = min(cell_of(min(at.xy + stretched, vec2(1.0))), ivec2(edge - 1));
    for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x) visit(sector_at(ivec3(x, y, face)), 0u, row);
}
#endif

void scatter(uint i) {
#if SAMPLED
    uint row = texelFetch(drawn_rows, int(list[i])).r;
#else
    uint row = list[i];
#endif
#if DISCS
    vec4 sight = texelFetch(sights, int(row));
    for (int face = 0; face < SECTOR_FACES; ++face) {
        vec3 at;
        if (find_sight(sight.xyz, face, at) && all(lessThan(abs(at.xy), vec2(2.0)))) visit_disc(row, at, sight.w, face);
    }
#else
    uint sector = sector_of(texelFetch(spots, int(row)).xyz);
    if (sector != NOTHING) visit(sector, 0u, row);
#endif
}
