// Lists the slots of active points.
#include "auto_splats/seen.glsl"

void main() {
    uint i = item(), row;
    vec2 pixel;
    float depth;
    if (i < item_count && is_seen(i, pixel, depth, row) && is_active(pixel, depth)) add(i, row);
}
