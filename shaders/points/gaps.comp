// Closes gaps of one pixel between points that would touch if more of them were drawn: where three of the four pixels
// around are nearer by more than `step_depth`, the nearest of these is shown. Depths and rows are read from copies.
#include "common/item.glsl"
#include "common/view.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;  // float bits
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
layout(std430, binding = STORAGE_DEPTHS) writeonly buffer Depths { uint closed_depths[]; };
layout(std430, binding = STORAGE_ROWS) writeonly buffer Rows { uint closed_rows[]; };
uniform float step_depth;

void main() {
    int pixel = int(item());
    if (pixel >= view_size.x * view_size.y) return;
    int x = pixel % view_size.x, y = pixel / view_size.x;
    if (x == 0 || y == 0 || x == view_size.x - 1 || y == view_size.y - 1) return;
    int around[4] = int[](pixel - view_size.x, pixel - 1, pixel + 1, pixel + view_size.x);
    float beyond = uintBitsToFloat(texelFetch(depths, pixel).r) - step_depth;
    uint nearest = NO_DEPTH;
    int nearer = 0, source = 0;
    for (int i = 0; i < 4; ++i) {
        uint key = texelFetch(depths, around[i]).r;
        nearer += int(uintBitsToFloat(key) < beyond);
        if (key < nearest) {
            nearest = key;
            source = around[i];
        }
    }
    if (nearer < 3) return;
    closed_depths[pixel] = nearest;
    closed_rows[pixel] = texelFetch(rows, source).r;
}
