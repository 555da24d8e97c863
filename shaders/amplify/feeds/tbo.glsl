// Feed: buffer textures, read by instance.
#include "amplify/texels.glsl"

Point fetch_point() { return texel_point(drawn_row(gl_InstanceID)); }

int corner_number() { return gl_VertexID; }
