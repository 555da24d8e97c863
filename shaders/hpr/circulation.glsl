// What a listed sector tells of its candidate's surroundings (Machado e Silva 2014, 5.3). Its neighbours are gone around:
// two candidates that follow one another there, at most WIDEST sectors apart, make a triangle with its own. Each is added
// to the candidate: the triangles' normals towards the eye, the less the farther apart (Max 1999), and of all neighbours
// with another candidate how many there are, and the inverse distances of these, in edges of a sector.
#include "common/view.glsl"
#include "common/list.glsl"
#include "hpr/extents.glsl"

layout(binding = TEXTURE_CANDIDATES) uniform usamplerBuffer candidates;  // a row for each sector
layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;

const int WIDEST = 3;

// The eight steps around, clockwise from the upper left.
ivec2 step_around(int j) { return (ivec2(0x06A4, 0x6A40) >> 2 * j & 3) - 1; }

float nearness(vec3 offset) { return min(inversesqrt(dot(offset, offset)), 1.0); }

// Offsets in edges of a sector.
vec3 normal_between(vec3 a, vec3 b, vec3 to_eye) {
    vec3 across = cross(a, b);
    float size = dot(a, a) * dot(b, b);
    if (size == 0.0) return vec3(0.0);
    across *= inversesqrt(size) * nearness(a) * nearness(b);
    return dot(across, to_eye) < 0.0 ? -across : across;
}

void scatter(uint i) {
    uint sector = list[i];
    uint own = texelFetch(candidates, int(sector)).r;
    if (own == NOTHING) return;
    ivec3 place = place_of(sector);
    vec3 center = texelFetch(positions, int(own)).xyz;
    vec3 to_eye = (view_perspective ? -to_view(center) : vec3(0.0, 0.0, 1.0)) * mat3(world_to_view);
    float width = sector_width(spot_of(own));
    float numbers[CHANNELS] = float[](0.0, 0.0, 0.0, 0.0, 0.0);
    vec3 normal = vec3(0.0), first_offset = vec3(0.0), last_offset = vec3(0.0);
    uint first = NOTHING, last = NOTHING;
    int first_at = 0, last_at = 0;
    for (int j = 0; j < 8; ++j) {
        uint neighbor = neighbor_at(place, step_around(j));
        uint other = neighbor == NOTHING ? NOTHING : texelFetch(candidates, int(neighbor)).r;
        if (other == NOTHING || other == own) continue;
        vec3 offset = (texelFetch(positions, int(other)).xyz - center) / width;
        numbers[3] += 1.0;
        numbers[4] += nearness(offset);
        if (last != NOTHING && last != other && j - last_at <= WIDEST)
            normal += normal_between(last_offset, offset, to_eye);
        if (first == NOTHING) {
            first = other;
            first_at = j;
            first_offset = offset;
        }
        last = other;
        last_at = j;
        last_offset = offset;
    }
    if (last == NOTHING) return;
    if (last != first && first_at + 8 - last_at <= WIDEST) normal += normal_between(last_offset, first_offset, to_eye);
    for (int k = 0; k < 3; ++k) numbers[k] = normal[k];
    add(own, numbers);
}
