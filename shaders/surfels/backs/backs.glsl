// Splats that face away, over a picture of what faces the eye, and its cells, in which they are seen or not.
// TILED: by what the lists of tiles know of them (surfels/tiles/cells.glsl).
#include "amplify/texels.glsl"
#include "surfels/splat.glsl"

ivec2 cells = (view_size + CELL - 1) / CELL;  // that cover the picture

#if TILED
layout(binding = TEXTURE_PLACES) uniform samplerBuffer places;
layout(binding = TEXTURE_AWAY) uniform usamplerBuffer away_depths;
#endif

// Cosine of the angle between a splat's normal and the direction to the eye.
float facing_of(Point point, vec3 center) {
    vec3 to_eye = towards_eye(center);
    return dot(mat3(world_to_view) * splat_normal(point, to_eye), to_eye) / length(to_eye);
}

// Whether the i-th that is drawn faces away; its centre's pixel coordinates and depth.
bool is_back(uint i, out vec3 place) {
#if TILED
    place = texelFetch(places, int(i)).xyz;
    place.z = linear_depth(place.z);
    return texelFetch(away_depths, int(i)).r != 0u;
#else
    Point point = texel_point(drawn_row(int(i)));
    vec3 center = to_view(point.position);
    place = vec3(to_pixel(center), -center.z);
    return in_depth_range(place.z) && facing_of(point, center) <= 0.0;
#endif
}

// The pixel of a place; of one beside the picture, the nearest.
ivec2 pixel_at(vec2 place) {
    return ivec2(clamp(floor(place), vec2(0.0), vec2(view_size - 1)));
}
