// The second of two passes (Slomp 2014, V-B): of the listed discs, enlarged, those that pass at most
// so far behind what the first pass found at a pixel, weighted by their masks. Where that found nothing,
// the nearest listed disc fills the pixel, which is listed for surfels/passes/close.comp.
#include "surfels/tiles/nearest.glsl"
#include "surfels/passes/limit.glsl"
#include "surfels/passes/look.glsl"
#include "surfels/passes/store.glsl"
#include "common/list.glsl"

// A float holds the sums of so many discs exactly, an integer those of a whole list: the order of a
// tile's list, which changes from frame to frame, does not show.
const int BLOCK = 256;

float limit[ROWS];
int total[ROWS];
ivec3 color[ROWS], normal[ROWS];
vec3 visible[ROWS];  // normals

void blend(int first, int last) {
    float weight_sum[ROWS];
    vec3 color_sum[ROWS], normal_sum[ROWS];
    for (int k = 0; k < ROWS; ++k) {
        weight_sum[k] = 0.0;
        color_sum[k] = normal_sum[k] = vec3(0.0);
    }
    for (int i = first; i < last; ++i) {
        uint row = texelFetch(listed, i).r;
        Column c = column_of(row);
        uvec2 look = texelFetch(looks, int(row)).xy;
        vec3 rgb = color_of(look), n = normal_of(look);
        for (int k = 0; k < ROWS; ++k) {
            float y = down_at(c, k), here = key_at(c, y), form = form_at(c, y);
            float edge = PERSPECTIVE != 0 ? here * here : 1.0;
            bool counts = form <= edge && here >= limit[k];
            float weight = counts ? weight_at(0.25 * falloff * form / edge) : 0.0;
            weight_sum[k] += weight;
            color_sum[k] += weight * rgb;
            normal_sum[k] += turned(weight, n, visible[k]) * n;
        }
    }
    for (int k = 0; k < ROWS; ++k) {
        total[k] += int(weight_sum[k]);
        color[k] += ivec3(color_sum[k]);
        normal[k] += ivec3(normal_sum[k]);
    }
}

void main() {
    int tile = this_tile();
    begin_pixels();
    ivec2 part = part_of(tile);
#if ENLARGED
    bool hole[ROWS], holes = false;
    for (int k = 0; k < ROWS; ++k) {
        hole[k] = shown[k] == NONE;
        holes = holes || hole[k];
    }
    take_nearest(holes ? part : ivec2(0), true);
#endif
    for (int k = 0; k < ROWS; ++k) {
        limit[k] = shown[k] == NONE ? 1.0 : limit_behind(linear_depth(best[k]), shown[k]);
        visible[k] = shown[k] == NONE ? vec3(0.0) : normal_of(texelFetch(looks, int(shown[k])).xy);
        total[k] = 0;
        color[k] = normal[k] = ivec3(0);
    }
    for (int first = part.x; first < part.y; first += BLOCK) blend(first, min(first + BLOCK, part.y));
    if (tile < 0) return;
    for (int k = 0; k < ROWS; ++k)
        if (in_picture(k) && shown[k] != NONE) {
            int index = index_of(k);
            store_mean(index, vec3(color[k]), vec3(normal[k]), float(total[k]), 1.0, shown[k]);
#if ENLARGED
            if (!hole[k]) continue;
            depths[index] = floatBitsToUint(-linear_depth(best[k]));
            rows[index] = shown[k];
            list[reserve(1u)] = uint(index);
#endif
        }
}
