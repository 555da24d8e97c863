// What hpr/sectors.glsl says of each sector: its direction, the sector that this is in, and its neighbours.
#include "common/item.glsl"
#include "hpr/sectors.glsl"

layout(std430, binding = STORAGE_WORDS) buffer Told { uint told[]; };

void main() {
    uint sector = item();
    if (sector >= item_count) return;
    vec3 direction = direction_of(sector);
    for (int n = 0; n < 3; ++n) told[12u * sector + uint(n)] = floatBitsToUint(direction[n]);
    told[12u * sector + 3u] = sector_of(CUBE == 1 ? direction : vec3(direction.yz, 0.0));
    uint at = 12u * sector + 4u;
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
            if (x != 0 || y != 0) told[at++] = neighbor_of(sector, ivec2(x, y));
}
