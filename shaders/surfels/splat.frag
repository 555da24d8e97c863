// The round Gaussian mask of a splat, cut off (Slomp 2014, V-B), opaque.
#include "common/view.glsl"
#include <params>

#ifndef DIVISOR
#define DIVISOR 1.0  // of the depth buffer's values
#define SIGN 1.0     // of the depth written
#endif

flat in uint row;
in vec2 local;

layout(location = 0) out uint out_row;
layout(location = 1) out float out_depth;

void main() {
    // Where the near plane cuts a splat, rounding may take fragments before it.
    float depth = max(linear_depth(gl_FragCoord.z * DIVISOR), view_near);
    if (dot(local, local) > mask_limit || depth > view_far) discard;
    out_row = row;
    out_depth = SIGN * depth;
}
