// Marks the listed points that are visible: those on the hull of the flipped candidates around them, also where they
// share a sector with a better one. SAMPLED: the list is of places in a list of rows.
//
// Another point beats this one in the direction y away from it where v.y > b, v being the way to the other's direction
// and b = (v.v + (h_other - h) / weight) / 2, with h how far they are: a half plane of y. This one is on the hull where
// there is a y, within the sectors that are looked at, that lies in none of them. It is found by projections on
// their edges (Agmon 1954).
#include "common/item.glsl"
#include "common/list.glsl"
#include "hpr/drawn_row.glsl"
#include "hpr/sectors.glsl"

layout(std430, binding = STORAGE_VISIBLE) buffer Visible { uint visible[]; };
layout(binding = TEXTURE_HOMES) uniform usamplerBuffer homes;
layout(binding = TEXTURE_BEST) uniform usamplerBuffer rows;
layout(binding = TEXTURE_SPOTS) uniform samplerBuffer spots;

const int LOOKED_AT = 9;
const int ROUNDS = 4;
const float REACH = 2.5, ROUNDED = 0.02;  // strides
uniform int stride;  // sectors between those that are looked at

void main() {
    uint i = item();
    if (i >= list_count) return;
    i = list[i];
    uint row = drawn_row(i);
    vec3 spot = texelFetch(spots, int(row)).xyz;
    ivec3 place = place_of(texelFetch(homes, int(i)).r);
    float scale = 1.0 / (float(stride) * sector_size());
    float far = farther_of(spot), bend = (weight - 0.5 * tangent * tangent * far) / (scale * scale);
    vec4 sides[LOOKED_AT];
    bool first = true;
    for (int n = 0; n < LOOKED_AT; ++n) {
        sides[n] = vec4(0.0);
        uint neighbor = neighbor_at(place, stride * ivec2(n % 3 - 1, n / 3 - 1));
        if (neighbor == NOTHING) continue;
        uint other = texelFetch(rows, int(neighbor)).r;
        if (other == NOTHING || other == row) continue;
        vec3 to = texelFetch(spots, int(other)).xyz;
        vec3 v = scale * across(spot, to);
        float squared = dot(v, v), twice = squared + (farther_of(to) - far) / bend;
        if (squared == 0.0) first = first && (twice > 0.0 || (twice == 0.0 && row < other));
        else sides[n] = vec4(v, 0.5 * twice) * inversesqrt(squared);
    }
    vec3 y = vec3(0.0);
    for (int round = 0; round < ROUNDS; ++round)
        for (int n = 0; n < LOOKED_AT; ++n) y -= max(dot(sides[n].xyz, y) - sides[n].w, 0.0) * sides[n].xyz;
    float most = 0.0;
    for (int n = 0; n < LOOKED_AT; ++n) most = max(most, dot(sides[n].xyz, y) - sides[n].w);
    if (first && most <= ROUNDED && dot(y, y) <= REACH * REACH) visible[row] = 1u;
}
