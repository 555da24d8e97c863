// Feed: vertex attributes that advance with the instance (divisor 1).
#include "amplify/attributes.glsl"

Point fetch_point() { return attribute_point(gl_InstanceID); }

int corner_number() { return gl_VertexID; }
