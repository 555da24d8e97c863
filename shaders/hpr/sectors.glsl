// Sectors around an eye: `Sectors` in viewer/visibility/sectors.py, which is the plain twin and says what is what.
// CUBE: six faces; else a grid of one. Several programs compare keys, so that these are `precise`.
#include "common/split.glsl"
#include <params>

const int SECTOR_FACES = CUBE == 1 ? 6 : 1;

uint sector_count() { return uint(SECTOR_FACES * edge * edge); }

// From the cube's axes to forward, right and down of a face, and back.
vec3 to_face(vec3 v, int face) {
    vec3 turned = face < 2 ? v : face < 4 ? v.yzx : v.zxy;
    return (face & 1) == 1 ? vec3(-turned.x, turned.zy) : turned;
}

vec3 from_face(vec3 v, int face) {
    vec3 turned = (face & 1) == 1 ? vec3(-v.x, v.zy) : v;
    return face < 2 ? turned : face < 4 ? turned.zxy : turned.yzx;
}

int face_of(vec3 v) {
    vec3 size = abs(v);
    if (size.x >= size.y && size.x >= size.z) return v.x < 0.0 ? 1 : 0;
    if (size.y >= size.z) return v.y < 0.0 ? 3 : 2;
    return v.z < 0.0 ? 5 : 4;
}

// atan(t x) / t and tan(t x) / t for |t x| up to 1 and to pi / 4; x for t = 0 (Abramowitz and Stegun 4.4.49, 4.3.101).
vec2 angles_of(vec2 x) {
    precise vec2 z = tangent * x;
    z = z * z;
    precise vec2 sum = 0.0028662257 * z - 0.0161657367;
    sum = sum * z + 0.0429096138;
    sum = sum * z - 0.0752896400;
    sum = sum * z + 0.1065626393;
    sum = sum * z - 0.1420889944;
    sum = sum * z + 0.1999355085;
    sum = sum * z - 0.3333314528;
    sum = sum * z + 1.0;
    return x * sum;
}

vec2 tangents_of(vec2 x) {
    precise vec2 z = tangent * x;
    z = z * z;
    precise vec2 sum = 0.0095168091 * z + 0.0029005250;
    sum = sum * z + 0.0245650893;
    sum = sum * z + 0.0533740603;
    sum = sum * z + 0.1333923995;
    sum = sum * z + 0.3333314036;
    sum = sum * z + 1.0;
    precise vec2 result = x * sum;
    return result;
}

// The spot of a position; whether it has one: a point behind the eye, or at it, has none.
bool find_spot(vec3 position, out vec3 spot) {
    precise vec3 offset = to_sectors[0].xyz * position.x + to_sectors[1].xyz * position.y;
    offset = offset + to_sectors[2].xyz * position.z;
    offset = offset + to_sectors[3].xyz;
#if CUBE
    spot = offset;
    return offset != vec3(0.0);
#else
    precise float aside = offset.y * offset.y + offset.z * offset.z;
    precise float ahead = 1.0 + closeness * offset.x;
    precise float far = sqrt(ahead * ahead + closeness * closeness * aside);
    precise float farther = (closeness * (offset.x * offset.x + aside) + 2.0 * offset.x) / (far + 1.0);
    precise vec2 tangents = lateral * offset.yz / ahead;
    spot = vec3(tangents, farther);
    return ahead > 0.0;
#endif
}

// The sector that a spot is in, NOTHING where in none.
uint sector_of(vec3 spot) {
#if CUBE
    int face = face_of(spot);
    vec3 turned = to_face(spot, face);
    vec2 tangents = turned.yz / turned.x;
#else
    const int face = 0;
    vec2 tangents = spot.xy;
    if (any(greaterThan(abs(tangents), vec2(2.0)))) return NOTHING;
#endif
    ivec2 at = ivec2(floor((angles_of(tangents) / half_angle + 1.0) * (0.5 * float(edge))));
#if CUBE
    at = clamp(at, ivec2(0), ivec2(edge - 1));
#else
    if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, ivec2(edge)))) return NOTHING;
#endif
    return uint((face * edge + at.y) * edge + at.x);
}

// Column, line and face of a sector.
ivec3 place_of(uint sector) {
    ivec2 column = split(int(sector), edge);
#if CUBE
    return ivec3(column.x, split(column.y, edge));
#else
    return ivec3(column, 0);
#endif
}

uint sector_at(ivec3 place) { return uint((place.z * edge + place.y) * edge + place.x); }

vec3 direction_at(ivec3 place) {
    precise vec2 angles = half_angle * (vec2(2 * place.xy + 1) / float(edge) - 1.0);
    vec2 tangents = tangents_of(angles);
#if CUBE
    precise float far = sqrt(1.0 + tangents.x * tangents.x + tangents.y * tangents.y);
    precise vec3 direction = from_face(vec3(1.0, tangents), place.z) / far;
    return direction;
#else
    return vec3(1.0, tangents);
#endif
}

vec3 direction_of(uint sector) { return direction_at(place_of(sector)); }

// The sector one step of -1, 0, 1 to the right and down, NOTHING where there is none: at the edge of a grid, across
// the corners of a cube.
uint neighbor_at(ivec3 place, ivec2 step) {
    ivec2 at = place.xy + step;
    bvec2 over = bvec2(at.x < 0 || at.x >= edge, at.y < 0 || at.y >= edge);
    if (!any(over)) return sector_at(ivec3(at, place.z));
#if CUBE
    if (all(over)) return NOTHING;
    // In whole numbers of half sectors: what was ahead is the first beside the edge.
    ivec2 aside = 2 * at + 1 - edge;
    aside = ivec2(over.x ? sign(aside.x) * edge : aside.x, over.y ? sign(aside.y) * edge : aside.y);
    vec3 offset = from_face(vec3(edge - 1, aside), place.z);
    int face = face_of(offset);
    ivec2 found = (ivec2(to_face(offset, face).yz) + edge - 1) / 2;
    return sector_at(ivec3(found, face));
#else
    return NOTHING;
#endif
}

uint neighbor_of(uint sector, ivec2 step) { return neighbor_at(place_of(sector), step); }

// How far a spot is from the eye, in units: beyond the center of a grid.
float farther_of(vec3 spot) { return CUBE == 1 ? length(spot) : spot.z; }

// The way from one spot's direction to another's, near it, along axes at right angles: its square is q of keys.
vec3 across(vec3 from, vec3 to) {
#if CUBE
    precise vec3 apart = normalize(to) - normalize(from);  // 0 between equal points, where a contracted product would leave a rest
    return apart;
#else
    vec2 apart = to.xy - from.xy;
    float t2 = tangent * tangent, out_from = dot(from.xy, from.xy);
    float stretch = inversesqrt(1.0 + t2 * out_from);
    float along = out_from > 0.0 ? (stretch - 1.0) * dot(apart, from.xy) / out_from : 0.0;
    return vec3(stretch * (apart + along * from.xy), 0.0);
#endif
}

// What is least for the point whose flip is farthest along a direction.
float distance_key(vec3 spot, vec3 direction) {
#if CUBE
    precise float far = sqrt(spot.x * spot.x + spot.y * spot.y + spot.z * spot.z);
    precise vec3 apart = spot / far - direction;
    precise float q = apart.x * apart.x + apart.y * apart.y + apart.z * apart.z;
    precise float key = weight * q + far * (1.0 - 0.5 * q);
#else
    precise float t2 = tangent * tangent;
    precise vec2 apart = spot.xy - direction.yz;
    precise float turn = spot.x * apart.y - spot.y * apart.x;
    precise float a = 1.0 + t2 * (spot.x * spot.x + spot.y * spot.y);
    precise float b = 1.0 + t2 * (direction.y * direction.y + direction.z * direction.z);
    precise float both = sqrt(a * b);
    precise float squared = apart.x * apart.x + apart.y * apart.y + t2 * turn * turn;
    precise float along = 1.0 + t2 * (spot.x * direction.y + spot.y * direction.z);
    precise float q = 2.0 * squared / (both * (both + along));  // |u - d|^2 / t2
    precise float key = weight * q + spot.z * (1.0 - 0.5 * t2 * q);
#endif
    return key;
}

// The same as a word in the same order, below +inf bits as scatter wants it: half as fine as a float.
uint key_of(vec3 spot, vec3 direction) {
    uint bits = floatBitsToUint(clamp(distance_key(spot, direction), -1e38, 1e38));
    return (bits & 0x80000000u) != 0u ? ~bits >> 1u : (bits | 0x80000000u) >> 1u;
}

float key_from(uint key) {
    return uintBitsToFloat((key & 0x40000000u) != 0u ? key << 1u & 0x7fffffffu : ~(key << 1u));
}

// The width of a sector in the middle of a face, in the terms of `across`.
float sector_size() { return 2.0 * half_angle / float(edge); }
