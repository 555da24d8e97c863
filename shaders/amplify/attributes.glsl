// A point from vertex attributes.
#include "amplify/point.glsl"

layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
#if HAS_RADIUS
layout(location = 2) in float in_radius;
#else
const float in_radius = 0.0;
#endif
#if HAS_AXES
layout(location = 3) in vec4 in_axes;
#else
const vec4 in_axes = vec4(0.0);
#endif
#if HAS_CELLS
layout(location = 5) in vec4 in_cell;
#else
const vec4 in_cell = vec4(0.0);
#endif

#ifdef FED_COLOR
layout(location = 4) in vec4 in_color;
#endif

Point attribute_point(int i) {
#ifdef FED_COLOR
    fed_color = in_color.rgb;
#endif
    return Point(in_position, in_normal, in_radius, in_axes, in_cell, uint(i));
}
