// How far apart points lie around each listed one: the FEWEST-th to the NEAREST-th nearest point tell a spacing each, and
// the largest counts. The size of voxels does not change it. A ball of half a voxel's edge is searched. Points that have
// too few others there go into the next list, LAST into none.
#include "common/item.glsl"
#include "hpr/next_list.glsl"
#include "hpr/voxels.glsl"

layout(binding = TEXTURE_STARTS) uniform usamplerBuffer starts;
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;
layout(std430, binding = STORAGE_SPACINGS) writeonly buffer Spacings { float spacings[]; };

const float FARTHEST = 0.25;  // squared radius of the ball, in voxels

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint row = list[i];
    vec3 own = point_at(row);
    ivec3 first = voxel_of(own - 0.5);
    float squares[NEAREST];  // of distances, ascending
    for (int k = 0; k < NEAREST; ++k) squares[k] = FARTHEST;
    for (int corner = 0; corner < 8; ++corner) {
        ivec3 voxel = first + (ivec3(corner) >> ivec3(0, 1, 2) & 1);
        int place = int(place_of(voxel)), last = int(texelFetch(starts, place + 1).r);
        for (int j = int(texelFetch(starts, place).r); j < last; ++j) {
            vec3 other = point_at(texelFetch(listed, j).r), away = other - own;
            float square = dot(away, away);
            square = square > 0.0 && voxel_of(other) == voxel ? square : FARTHEST;
            if (square >= squares[NEAREST - 1]) continue;
            for (int k = 0; k < NEAREST; ++k) {
                float less = min(squares[k], square);
                square = max(squares[k], square);
                squares[k] = less;
            }
        }
    }
#if !LAST
    if (squares[NEAREST - 1] >= FARTHEST) {
        next_list[reserve_next(1u)] = row;
        return;
    }
#endif
    // Of one point for each square of the spacing, the k-th nearest lies within k / pi of them.
    float most = 0.0;
    for (int k = FEWEST; k <= NEAREST; ++k) most = max(most, squares[k - 1] / float(k));
    spacings[row] = sqrt(3.14159265 * most) / per_voxel;
}
