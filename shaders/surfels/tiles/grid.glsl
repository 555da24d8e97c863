// Tiles of TILE x TILE pixels, from the upper left.
#include "common/view.glsl"

ivec2 tiles = (view_size + TILE - 1) / TILE;  // those that cover the picture
