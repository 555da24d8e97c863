// Blocks of pixels, from the upper left.
#include "common/view.glsl"

// How many cover a picture.
ivec2 blocks_of(ivec2 size) { return (size + BLOCK - 1) / BLOCK; }
