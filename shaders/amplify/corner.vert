// A corner of a shape: the feeds without a geometry stage.
#include "common/view.glsl"

// Point fetch_point() and int corner_number().
#include <feed>
// bool begin_shape(Point) and Corner corner(int).
#include <shape>

flat out uint row;
#ifdef SHADED
flat out vec3 color;
#endif
out vec2 local;

void main() {
    Point point = fetch_point();
    row = point.row;
#ifdef SHADED
    color = color_of(point);
#endif
    local = vec2(0.0);
    gl_Position = vec4(0.0, 0.0, -1.0, 1.0);  // nowhere: in front of the near plane
    if (!begin_shape(point)) return;
    Corner c = corner(corner_number());
    gl_Position = to_clip(c.view);
    local = c.local;
}
