// The splat of a point, as it is stored, and which way it faces.
#include "common/octahedron.glsl"
#include "common/tangent.glsl"

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
#if BY_SCANNER
layout(binding = TEXTURE_RANGE_VIEWS) uniform samplerBuffer range_views;  // its eye, and its first row
#endif
layout(std430, binding = STORAGE_SPLATS) buffer Splats { uint splats[]; };  // as amplify/packed.glsl reads
layout(std430, binding = STORAGE_LOOKS) writeonly buffer Looks { uint looks[]; };  // as surfels/passes/look.glsl reads

const float LEANING = 1.19;  // factor on how far a cell reaches, for splats that lean
const float LEAST_ROUND = 0.25;  // of the longer half-axis, what the shorter one is at least
const float LEAST_CUT = 0.3;  // of a splat's width, what is left where the surface ends
const float SLACK = 1.5;  // pixels that splats reach beyond that end, so that none leaves a gap

// What a normal of this place points to, along the pose's axes.
vec3 seen_from(uint row) {
    vec3 place = texelFetch(positions, int(row)).xyz;
#if BY_SCANNER
    vec3 scanner = vec3(0.0);
    for (int i = 0; i < SCANNERS; ++i) {
        vec4 view = texelFetch(range_views, i);
        if (row >= floatBitsToUint(view.w)) scanner = view.xyz;
    }
    return scanner - place;
#else
    return transpose(mat3(world_to_view)) * (view_perspective ? -to_view(place) : vec3(0.0, 0.0, 1.0));
#endif
}

// Which way a splat's longer half-axis lies, and how round it is, as amplify/packed.glsl has it.
uint pack_axes(vec3 normal, vec3 longer, float roundness) {
    vec3 u = tangent_of(normal), v = cross(normal, u);
    float angle = atan(dot(longer, v), dot(longer, u)) / 3.14159265;
    return packUnorm2x16(vec2(angle < 0.0 ? angle + 1.0 : angle, max(roundness, LEAST_ROUND)));
}

// Of a round splat, what the eye sees where the picture of the surface ends at a distance from the point: an ellipse, whose
// side there moves to that end, while the opposite side stays. to: unit vector of the plane. Returns how far the middle
// lies from the point, along the shorter half-axis as it is packed. radius: becomes the shorter half-axis.
float cut(vec3 normal, vec3 to, float end, float pixel, inout float radius, out vec3 longer, out float roundness) {
    precise float left = clamp(0.5 + 0.5 * (end + SLACK * pixel) / radius, LEAST_CUT, 1.0);
    precise float shift = (left - 1.0) * radius;
    roundness = left;
    radius *= left;
    longer = cross(normal, to);
    // Half-axes are packed as half a turn, from the tangent on.
    vec3 tangent = tangent_of(normal);
    float beside = dot(longer, cross(normal, tangent));
    bool turns = beside < 0.0 || (beside == 0.0 && dot(longer, tangent) < 0.0);
    longer = turns ? -longer : longer;
    return turns ? -shift : shift;
}
