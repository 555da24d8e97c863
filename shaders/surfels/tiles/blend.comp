// The second of two passes (Slomp 2014, V-B): of the listed discs, enlarged, those that pass at most
// so far behind what is visible at a pixel, weighted by their masks. LARGE: on top of what the rasteriser
// has added up of others. TAKE: the nearest are found first, 1 of the lists, 2 of the lists of those that face
// away (AWAY), beside what the Surface holds.
#include "surfels/tiles/nearest.glsl"
#include "surfels/passes/limit.glsl"
#include "surfels/passes/look.glsl"
#include "surfels/passes/store.glsl"
#include "common/split.glsl"

// A float holds the sums of so many discs exactly, an integer those of a whole list (TileLists): the order of a
// tile's list, which changes from frame to frame, does not show.
const int BLOCK = 132;

#if LARGE
layout(binding = TEXTURE_COLOR_SUMS) uniform sampler2D color_sums;  // and weight
layout(binding = TEXTURE_NORMAL_SUMS) uniform sampler2D normal_sums;
#endif

float limit[ROWS];
int total[ROWS];
uvec3 light[ROWS];
ivec3 normal[ROWS];
vec3 visible[ROWS];  // normals

void blend_block(usamplerBuffer list, int first, int last) {
    float weight_sum[ROWS];
    vec3 light_sum[ROWS], normal_sum[ROWS];
    for (int k = 0; k < ROWS; ++k) {
        weight_sum[k] = 0.0;
        light_sum[k] = normal_sum[k] = vec3(0.0);
    }
    for (int i = first; i < last; ++i) {
        uint disc = texelFetch(list, i).r;
        Column c = column_of(disc);
        uvec2 look = texelFetch(looks, int(row_of(disc))).xy;
        vec3 rgb = light_of(look), n = normal_of(look);
        for (int k = 0; k < ROWS; ++k) {
            float y = down_at(c, k), here = key_at(c, y), form = form_at(c, y);
            float edge = PERSPECTIVE != 0 ? here * here : 1.0;
            bool counts = form <= edge && here >= limit[k];
            // Rounding takes the form of a disc that is seen edge on below zero, where the mask has no bound.
            float weight = counts ? weight_at(max(0.25 * falloff * form / edge, 0.0)) : 0.0;
            weight_sum[k] += weight;
            light_sum[k] += weight * rgb;
            normal_sum[k] += turned(weight, n, visible[k]) * n;
        }
    }
    for (int k = 0; k < ROWS; ++k) {
        total[k] += int(weight_sum[k]);
        light[k] += uvec3(light_sum[k]);
        normal[k] += ivec3(normal_sum[k]);
    }
}

void blend(usamplerBuffer list, ivec2 part) {
    for (int first = part.x; first < part.y; first += BLOCK) blend_block(list, first, min(first + BLOCK, part.y));
}

void main() {
    int tile = this_tile();
    ivec2 part = part_of(starts, tile);
#if AWAY
    ivec2 away_part = part_of(away_starts, tile);
#endif
#if TAKE
    begin_pixels();
#if TAKE == 1
    take_nearest(listed, part);
#else
    take_nearest(away_listed, away_part);
#endif
    if (tile >= 0)
        for (int k = 0; k < ROWS; ++k)
            if (in_picture(k)) store_pixel(k);
#endif
    for (int k = 0; k < ROWS; ++k) {
        limit[k] = 1.0;
        visible[k] = vec3(0.0);
        total[k] = 0;
        light[k] = uvec3(0u);
        normal[k] = ivec3(0);
#if TAKE
        if (!in_picture(k)) shown[k] = NOTHING;
        float depth = uintBitsToFloat(depth_bits(k));
#else
        shown[k] = in_picture(k) ? rows[index_of(k)] : NOTHING;
        float depth = in_picture(k) ? abs(uintBitsToFloat(depths[index_of(k)])) : 0.0;
#endif
        if (shown[k] != NOTHING) {
            limit[k] = limit_behind(depth, shown[k]);
            visible[k] = normal_of(texelFetch(looks, int(shown[k])).xy);
        }
#if LARGE
        vec4 rgb = texelFetch(color_sums, pixel + ivec2(0, k), 0);
        total[k] = int(rgb.a);
        light[k] = uvec3(rgb.rgb);
        normal[k] = ivec3(texelFetch(normal_sums, pixel + ivec2(0, k), 0).xyz);
#endif
    }
    blend(listed, part);
#if AWAY
    blend(away_listed, away_part);
#endif
    if (tile < 0) return;
    for (int k = 0; k < ROWS; ++k)
        if (shown[k] != NOTHING) {
            uint count = uint(max(total[k], 1));
            vec3 mean_light = means_of(light[k], count), mean_normal = means_of(normal[k], count);
            store_mean(index_of(k), mean_light, mean_normal, total[k] > 0, 1.0, shown[k]);
        }
}
