// Feed: a range of one larger buffer as a uniform block. An array of anything but vec4 is padded to
// it, so the attributes lie one after the other across vec4s.
#include "amplify/point.glsl"

layout(std140, binding = BLOCK_POINTS) uniform Points { vec4 packed_points[POINTS * STRIDE / 4]; };
uniform int first;  // row of the range's first point

float number(int at) { return packed_points[at >> 2][at & 3]; }

Point fetch_point() {
    int at = gl_InstanceID * STRIDE;
    vec3 position = vec3(number(at), number(at + 1), number(at + 2));
    vec3 normal = vec3(number(at + 3), number(at + 4), number(at + 5));
#if HAS_RADIUS
    float radius = number(at + 6);
#else
    const float radius = 0.0;
#endif
#if HAS_AXES
    vec4 axes = vec4(number(at + 7), number(at + 8), number(at + 9), number(at + 10));
#else
    const vec4 axes = vec4(0.0);
#endif
#ifdef FED_COLOR
    int color_at = at + 6 + HAS_RADIUS + 4 * HAS_AXES;
    fed_color = vec3(number(color_at), number(color_at + 1), number(color_at + 2)) / 255.0;
#endif
    return Point(position, normal, radius, axes, vec4(0.0), uint(first + gl_InstanceID));
}

int corner_number() { return gl_VertexID; }
