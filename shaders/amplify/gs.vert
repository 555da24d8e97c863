// Geometry-shader feed: the vertex shader only forwards (Slomp 2014, IV-A).
#include "amplify/attributes.glsl"

out Forwarded {
    Point point;
#ifdef SHADED
    vec3 color;
#endif
} forwarded;

void main() {
    forwarded.point = attribute_point(gl_VertexID);
#ifdef SHADED
    forwarded.color = color_of(forwarded.point);
#endif
}
