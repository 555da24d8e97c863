// Whether a point lies behind what the Surface shows there, by more than `slack` radii of the splat that is shown.
#include "amplify/texels.glsl"
#include "surfels/passes/limit.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;

uniform float slack;

// The depth of a splat's plane on the ray through a point of view space.
float plane_depth(vec3 at, vec3 center, vec3 normal) {
    if (view_perspective) return -at.z * dot(normal, center) / dot(normal, at);
    return dot(normal.xy, at.xy - center.xy) / normal.z - center.z;
}

// radius: of the splat that is shown, scan units.
bool is_hidden(int row, vec3 at, out float radius) {
    radius = 0.0;
    ivec2 pixel = ivec2(floor(to_pixel(at)));
    if (-at.z < view_near || any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, view_size))) return false;
    int index = pixel.y * view_size.x + pixel.x;
    uint shown = texelFetch(rows, index).r;
    if (shown == NOTHING || int(shown) == row) return false;
    float depth = uintBitsToFloat(texelFetch(depths, index).r);
    radius = visible_radius(depth, shown);
    // The pixel's depth is that at its centre, and steep surfaces have others around it.
    vec3 normal = mat3(world_to_view) * packed_normal(texelFetch(splats, int(shown)).xyz);
    float here = plane_depth(at, to_view(texelFetch(positions, int(shown)).xyz), normal);
    return -at.z > clamp(here, depth - radius, depth + radius) + slack * radius;
}
