// Geometry-shader feed: the template lives here, a point in, a triangle strip out.
#include "amplify/point.glsl"
#include "common/view.glsl"

// bool begin_shape(Point) and Corner corner(int).
#include <shape>

layout(points) in;
layout(triangle_strip, max_vertices = CORNERS) out;

in Forwarded {
    Point point;
#ifdef SHADED
    vec3 color;
#endif
} forwarded[];

flat out uint row;
#ifdef SHADED
flat out vec3 color;
#endif
out vec2 local;

void main() {
    if (!begin_shape(forwarded[0].point)) return;
    for (int i = 0; i < CORNERS; ++i) {
        Corner c = corner(i);
        gl_Position = to_clip(c.view);
        local = c.local;
        row = forwarded[0].point.row;
#ifdef SHADED
        color = forwarded[0].color;
#endif
        EmitVertex();
    }
    EndPrimitive();
}
