// How large sectors are in space, where a point lies.
#include "hpr/sectors.glsl"

layout(binding = TEXTURE_SPOTS) uniform samplerBuffer spots;

vec3 spot_of(uint row) { return texelFetch(spots, int(row)).xyz; }

// Scan units that an angle of one covers there; of parallel rays, that a unit aside is.
float reach_of(vec3 spot) {
#if CUBE
    return unit * length(spot);
#else
    return closeness > 0.0 ? unit / closeness + unit * spot.z : unit;
#endif
}

// What is 1 in the terms of `across` is so much of an angle.
float opening() { return CUBE == 0 && tangent > 0.0 ? tangent : 1.0; }

// The edge of a sector there, scan units.
float sector_width(vec3 spot) { return reach_of(spot) * opening() * sector_size(); }

// How far the middle of a sector passes a point there, scan units.
float sector_away(vec3 spot, vec3 direction) {
    vec3 middle = CUBE == 1 ? direction : vec3(direction.yz, 0.0);
    return reach_of(spot) * opening() * length(across(spot, middle));
}
