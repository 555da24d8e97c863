// Tiles of the picture, from the upper left, each with a list of discs; in parts of pixels, an invocation's each.
#include "common/view.glsl"

const ivec2 PART = ivec2(PART_WIDTH, PART_HEIGHT), PARTS = ivec2(COLUMNS, LINES), TILE = PART * PARTS;

ivec2 tiles = (view_size + TILE - 1) / TILE;  // those that cover the picture
