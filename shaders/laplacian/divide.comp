// Levels of a view's picture, from 1 on, of the sums of its samples there: divided by how much of samples a cell was given (the
// splat map).
#include "common/item.glsl"
#include "laplacian/sums.glsl"

layout(std430, binding = STORAGE_BANDS) writeonly buffer Bands { vec4 bands[]; };

uniform int start;  // of level 1 in the sums

void main() {
    uint n = item();
    if (n < item_count) bands[n] = mean_of_splats(start + int(n));
}
