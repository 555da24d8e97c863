// A participant's cell is the fine one that it falls into: points that are seen, and, HIDDEN_NEIGHBORS, those that another one
// hides which is not much nearer than what the coarse cells around see. One in the same place tells nothing.
#include "auto_splats/place.glsl"

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;
#endif
#if HIDDEN_NEIGHBORS
layout(binding = TEXTURE_FARTHEST) uniform samplerBuffer farthest;
layout(std430, binding = STORAGE_COPIED) writeonly buffer Copied { uint copied[]; };  // by coarse cell: 1 if one is left out
#endif

void scatter(uint i) {
#if SAMPLED
    i = texelFetch(drawn_rows, int(i)).r;
#endif
    vec3 place = texelFetch(positions, int(i)).xyz, view = to_view(place);
    vec2 pixel;
    if (!find_pixel(view, pixel)) return;
    uint shown = in_picture(pixel) ? texelFetch(rows, pixel_number(pixel)).r : NOTHING;
    if (shown != i) {
#if HIDDEN_NEIGHBORS
        if (-view.z > texelFetch(farthest, coarse_cell(pixel)).r) return;
        if (shown != NOTHING && texelFetch(positions, int(shown)).xyz == place) {
            copied[coarse_cell(pixel)] = 1u;
            return;
        }
#else
        return;
#endif
    }
    ivec2 cell = fine_cell(pixel);
    visit(uint(cell.y * fine_size.x + cell.x), 0u, i);
}
