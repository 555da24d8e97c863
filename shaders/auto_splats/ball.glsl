// A ball round `center`, the fine cells that its image may reach, and the participants in these. LANES: invocations
// that take these together.
#include "auto_splats/place.glsl"

layout(binding = TEXTURE_SLOTS) uniform usamplerBuffer slots;  // place, row and whether it is hidden
layout(binding = TEXTURE_STARTS) uniform usamplerBuffer starts;

const float ROUNDING = 0.02;  // pixels that a point's cell may be off by, and more

vec3 center;  // view space

// Where tangent planes through the eye cut the axis of pixels that `along` is the coordinate of.
vec2 tangents(float along, float radius, float middle) {
    if (!view_perspective) return middle + (along + vec2(-radius, radius)) * view_scale;
    float depth = -center.z, squared = depth * depth - radius * radius;
    if (squared <= 0.0) return vec2(-1e9, 1e9);
    vec2 slope = (along * depth + vec2(-radius, radius) * sqrt(along * along + squared)) / squared;
    return clamp(middle + slope * view_scale, -1e9, 1e9);
}

// First and last.
ivec4 cells_of(float radius) {
    vec2 x = tangents(center.x, radius, view_center.x), y = tangents(-center.y, radius, view_center.y);
    vec4 box = vec4(x.x, y.x, x.y, y.y) + ROUNDING * vec4(-2.0, -2.0, 2.0, 2.0);
    return clamp(ivec4(floor(box)) + margin >> fine_shift, ivec4(0), fine_size.xyxy - 1);
}

// From the center to the plane through the eye and a line of pixels, which are counted from the line of sight.
float plane_distance(float along, float pixel) {
    float slope = pixel / view_scale;
    return view_perspective ? abs(along + slope * center.z) * inversesqrt(1.0 + slope * slope) : abs(along - slope);
}

// The distance within which cells hold all participants; UNKNOWN: all that there are.
float known_within(ivec4 cells) {
    vec4 edge = vec4((cells + ivec4(0, 0, 1, 1) << fine_shift) - margin) + ROUNDING * vec4(1.0, 1.0, -1.0, -1.0);
    edge -= view_center.xyxy;
    vec4 known = vec4(UNKNOWN);
    if (cells.x > 0) known.x = plane_distance(center.x, edge.x);
    if (cells.y > 0) known.y = plane_distance(-center.y, edge.y);
    if (cells.z < fine_size.x - 1) known.z = plane_distance(center.x, edge.z);
    if (cells.w < fine_size.y - 1) known.w = plane_distance(-center.y, edge.w);
    return min(min(known.x, known.y), min(known.z, known.w));
}

// offset: from the point, in the scan's size; row: twice the row, 1 more where it is hidden.
void take(vec3 offset, uint row);

// Takes each of LANES participants in the cells, from a lane on.
void take_from(ivec4 cells, vec3 place, int lane) {
    for (int y = cells.y; y <= cells.w; ++y) {
        int line = y * fine_size.x, last = int(texelFetch(starts, line + cells.z + 1).r);
        for (int i = int(texelFetch(starts, line + cells.x).r) + lane; i < last; i += LANES) {
            uvec4 other = texelFetch(slots, i);
            take(uintBitsToFloat(other.xyz) - place, other.w);
        }
    }
}
