// Geometry-shader feed: the vertex shader only forwards (Slomp 2014, IV-A).
#include "amplify/attributes.glsl"

out Forwarded { Point point; } forwarded;

void main() {
    forwarded.point = attribute_point(gl_VertexID);
}
