// Clears the listed pixels of depths, rows and picture.
#include "common/item.glsl"
#include "common/list.glsl"

layout(std430, binding = STORAGE_DEPTHS) writeonly buffer Depths { uint depths[]; };
layout(std430, binding = STORAGE_ROWS) writeonly buffer Rows { uint rows[]; };
layout(std430, binding = STORAGE_CLEARED_PICTURE) writeonly buffer Picture { uint picture[]; };
uniform uint background;

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint pixel = list[i];
    if (pixel == NOTHING) return;
    depths[pixel] = NO_DEPTH;
    rows[pixel] = NOTHING;
    picture[pixel] = background;
}
