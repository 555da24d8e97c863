// A voxel's face, opaque.
#include "common/view.glsl"

flat in uint row;

layout(location = 0) out uint out_row;
layout(location = 1) out float out_depth;

void main() {
    float depth = linear_depth(gl_FragCoord.z);
    if (depth > view_far) discard;
    out_row = row;
    out_depth = depth;
}
