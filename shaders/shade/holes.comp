// Paints the holes of a picture: what the closing of the covered pixels by a square adds to them (Serra 1982), that is, those
// that no square of 2 HOLE_REACH + 1 pixels holds without a covered one. 32 pixels of a row are a word.
// STEP 0: which pixels are covered. 1: which are near to these. 2: which are far from all that are not; these are painted.
#include "common/view.glsl"
#include "common/item.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;  // float bits
layout(std430, binding = STORAGE_PICTURE) writeonly buffer Picture { uint picture[]; };
layout(std430, binding = STORAGE_PIXEL_BITS) buffer PixelBits { uvec2 pixel_bits[]; };  // covered; near
uniform vec4 hole_color;

// The pixels of a word that are in the picture.
uint inside(int column) {
    int pixels = view_size.x - 32 * column;
    return pixels >= 32 ? ~0u : (1u << pixels) - 1u;
}

#if STEP > 0
// What lies in the word: the covered, or those that are not near.
uint source(int column, int row, int across) {
    if (column < 0 || column >= across) return 0u;
    uvec2 bits = pixel_bits[row * across + column];
    return STEP == 1 ? bits.x : ~bits.y & inside(column);
}

// The pixels of a word that have some of these in reach, along both axes.
uint spread(int column, int row, int across) {
    uint before = 0u, right = 0u, after = 0u;
    for (int y = max(row - HOLE_REACH, 0); y <= min(row + HOLE_REACH, view_size.y - 1); ++y) {
        before |= source(column - 1, y, across);
        right |= source(column, y, across);
        after |= source(column + 1, y, across);
    }
    uint left = right;
    for (int i = 0; i < HOLE_REACH; ++i) {  // fewer than the bits of a word
        right |= right << 1 | before >> 31;
        before |= before << 1;
        left |= left >> 1 | after << 31;
        after |= after >> 1;
    }
    return left | right;
}
#endif

void main() {
    int across = (view_size.x + 31) / 32, index = int(item());
    if (index >= across * view_size.y) return;
    int column = index % across, row = index / across;
    int first = row * view_size.x + 32 * column;
#if STEP == 0
    uint covered = 0u;
    for (int i = 0; i < min(32, view_size.x - 32 * column); ++i)
        covered |= uint(texelFetch(depths, first + i).r < NO_DEPTH) << i;
    pixel_bits[index].x = covered;
#elif STEP == 1
    pixel_bits[index].y = spread(column, row, across);
#else
    uint holes = ~spread(column, row, across) & ~pixel_bits[index].x & inside(column);
    for (int i = 0; holes != 0u; ++i, holes >>= 1)
        if ((holes & 1u) != 0u) picture[first + i] = packUnorm4x8(hole_color);
#endif
}
