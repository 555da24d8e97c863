// A vertex where it is; a point has its number for a row.
#include "common/view.glsl"

layout(location = 0) in vec3 in_position;

flat out uint row;

void main() {
    gl_Position = to_clip(to_view(in_position));
    row = uint(gl_VertexID);
}
