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
