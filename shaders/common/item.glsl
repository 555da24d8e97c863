// Which item this invocation works on: groups run along two dimensions, since a driver
// need not allow more than 65 535 along one.
layout(local_size_x = 256) in;

uniform uint item_count;  // Gpu.dispatch sets it

uint item() {
    return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 256u + gl_LocalInvocationID.x;
}
