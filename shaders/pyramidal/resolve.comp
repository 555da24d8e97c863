// What pixels show of the samples that were scattered into them. <source> says what a sample is.
#include "common/item.glsl"
#include "common/split.glsl"
#include "common/view.glsl"
#include "pyramidal/pixels.glsl"
#include <source>

void main() {
    int i = int(item());
    if (i >= view_size.x * view_size.y || rows[i] == NOTHING) return;
    float depth = uintBitsToFloat(depths[i]);
    uint row;
    Seen seen;
    own_pixel(split(i, view_size.x), rows[i], depth, row, seen);
    store(i, depth, row, 0, seen);
}
