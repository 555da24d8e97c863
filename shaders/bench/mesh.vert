// A vertex of the mesh.
#include "common/view.glsl"

layout(location = 0) in vec3 in_position;

void main() {
    gl_Position = to_clip(to_view(in_position));
}
