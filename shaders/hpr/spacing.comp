// How far apart points lie around each listed one: by the number of them in a ball of half a voxel's edge. Those that have
// too few there go into the next list, LAST into none.
#include "common/item.glsl"
#include "hpr/next_list.glsl"
#include "hpr/voxels.glsl"

layout(binding = TEXTURE_STARTS) uniform usamplerBuffer starts;
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;
layout(std430, binding = STORAGE_SPACINGS) writeonly buffer Spacings { float spacings[]; };

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint row = list[i], count = 0u;
    vec3 own = point_at(row);
    ivec3 first = voxel_of(own - 0.5);
    for (int corner = 0; corner < 8; ++corner) {
        ivec3 voxel = first + (ivec3(corner) >> ivec3(0, 1, 2) & 1);
        int place = int(place_of(voxel)), last = int(texelFetch(starts, place + 1).r);
        for (int j = int(texelFetch(starts, place).r); j < last; ++j) {
            vec3 other = point_at(texelFetch(listed, j).r), away = other - own;
            count += uint(dot(away, away) <= 0.25 && voxel_of(other) == voxel);
        }
    }
#if !LAST
    if (count < ENOUGH) {
        next_list[reserve_next(1u)] = row;
        return;
    }
#endif
    spacings[row] = 0.5 / per_voxel * sqrt(3.14159265 / float(max(count, ENOUGH)));
}
