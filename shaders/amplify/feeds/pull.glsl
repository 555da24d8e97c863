// Feed: buffer textures without instances; the triangles of each strip one by one. Storage blocks
// would do as well, but a vertex stage need not have any.
#include "amplify/texels.glsl"

const int VERTICES = 3 * (CORNERS - 2);

Point fetch_point() { return texel_point(drawn_row(gl_VertexID / VERTICES)); }

// As a strip has them: every other triangle begins with its second corner, so that all turn the same way.
int corner_number() {
    int triangle = gl_VertexID % VERTICES / 3, corner = gl_VertexID % 3;
    return triangle + (corner < 2 ? corner ^ triangle & 1 : corner);
}
