// Targets of the levels 1 and up, one after another: level k has ceil(n / 2^k) columns and rows of cells, which hold
// the least depth among the samples that fall into them, and the lowest sample that has it.

ivec2 target_size(ivec2 size, int level) { return (size + (1 << level) - 1) >> level; }

// Index of the first cell of a level.
int target_start(ivec2 size, int level) {
    int start = 0;
    for (int k = 1; k < level; ++k) {
        ivec2 cells = target_size(size, k);
        start += cells.x * cells.y;
    }
    return start;
}
