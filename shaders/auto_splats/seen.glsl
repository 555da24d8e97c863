// Participants that a pixel shows, and whose neighborhoods are searched.
#include "common/item.glsl"
#include "common/list.glsl"
#include "auto_splats/place.glsl"

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
layout(binding = TEXTURE_NEAR_TO) uniform samplerBuffer near_to;
layout(std430, binding = STORAGE_DRAWN_ROWS) writeonly buffer DrawnRows { uint drawn_rows[]; };

bool is_near(vec2 pixel, float depth) { return depth <= texelFetch(near_to, coarse_cell(pixel)).r; }

// Whether a pixel shows a participant; and where it is.
bool is_seen(uint row, out vec2 pixel, out float depth) {
    vec3 view = to_view(texelFetch(positions, int(row)).xyz);
    depth = -view.z;
    find_pixel(view, pixel);
    return in_picture(pixel) && texelFetch(rows, pixel_number(pixel)).r == row;
}

void add(uint slot, uint row) {
    uint at = reserve(1u);
    list[at] = slot;
    drawn_rows[at] = row;
}
