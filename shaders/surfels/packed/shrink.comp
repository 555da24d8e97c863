// The radii of splats, those of hidden points no larger than what hides these. TILES: the forms of their discs as well,
// and which disc each row has.
#include "surfels/packed/hidden.glsl"
#include "common/item.glsl"

layout(std430, binding = STORAGE_RADII) writeonly buffer Radii { float new_radii[]; };
#if TILES
layout(binding = TEXTURE_NUMBERS) uniform usamplerBuffer numbers;  // of discs
layout(std430, binding = STORAGE_FORMS) buffer Forms { vec4 forms[]; };
layout(std430, binding = STORAGE_DISCS) writeonly buffer Discs { uint discs[]; };
#endif

void main() {
    uint i = item();
    if (i >= item_count) return;
    int row = drawn_row(int(i));
    vec3 at = to_view(texelFetch(positions, row).xyz);
    Point point = texel_point(row);
    float shown, share = 1.0, reach = splat_reach(point, -at.z);
    if (is_hidden(row, at, shown)) share = min(shown / reach, 1.0);
    new_radii[row] = point.radius * share;
#if TILES
    uint disc = texelFetch(numbers, int(i)).r;
    discs[row] = disc;
    if (share == 1.0 || disc == NOTHING) return;
    share = max(share, least_radius / scale_at(-at.z) / reach);
    forms[disc].yzw /= share * share;
#endif
}
