// Geometry-shader feed: the vertex shader only forwards (Slomp 2014, IV-A).
#include "amplify/attributes.glsl"

out Forwarded {
    Point point;
#ifdef FED_COLOR
    vec3 color;
#endif
} forwarded;

void main() {
    forwarded.point = attribute_point(gl_VertexID);
#ifdef FED_COLOR
    forwarded.color = fed_color;
#endif
}
