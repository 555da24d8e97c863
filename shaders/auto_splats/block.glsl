// Blocks of pixels, from the upper left.
#include "common/view.glsl"

ivec2 blocks = (view_size + BLOCK - 1) / BLOCK;  // those that cover the picture
