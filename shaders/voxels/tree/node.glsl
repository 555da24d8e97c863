// Nodes of an octree (viewer/backends/voxels/gpu_cut.py). A node has a number among all, level after level, and a cell: its
// coordinates among those of its level, 21 bits each, in two words.
uvec3 cell_of(uvec2 words) {
    return uvec3(words.x & 0x1FFFFFu, words.x >> 21 | (words.y & 0x3FFu) << 11, words.y >> 10);
}

uvec2 words_of(uvec3 cell) {
    return uvec2(cell.x | cell.y << 21, cell.y >> 11 | cell.z << 10);
}

// The middle of a cell, relative to the lowest corner of the cube.
dvec3 middle_of(uvec3 cell, double edge) {
    precise dvec3 middle = (dvec3(cell) + 0.5LF) * edge;
    return middle;
}
