// Which item this invocation works on: groups run along two dimensions, since a driver
// need not allow more than GROUP_LIMIT along one.

layout(local_size_x = GROUP) in;

uniform uint item_count;  // Gpu.dispatch sets it

uint item() {
    return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * uint(GROUP) + gl_LocalInvocationID.x;
}
