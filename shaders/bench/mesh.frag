// The face and its depth, between near and far.
#include "common/view.glsl"

layout(location = 0) out uint out_row;
layout(location = 1) out float out_depth;

void main() {
    float depth = linear_depth(gl_FragCoord.z);
    if (depth > view_far) discard;
    out_row = uint(gl_PrimitiveID);
    out_depth = depth;
}
