// Blocks of cells that know how many cells aside discs lie that reach into them, where these are more than usual.
#include "hpr/cells.glsl"

const int HALVINGS = 3;

ivec2 block_of(ivec2 cell) { return cell >> HALVINGS; }

int block_at(ivec3 block) {
    int blocks = (line_length() >> HALVINGS) + 1;
    return (block.z * blocks + block.y) * blocks + block.x;
}
