// The second of two passes (Slomp 2014, V-B): of the listed discs, enlarged, those that pass at most
// so far behind what is visible at a pixel, weighted by their masks. LARGE: on top of what the rasteriser
// has added up of others. TAKE: the nearest are found first, 1 of the lists, 2 of the lists of those that face
// away (AWAY), beside what the Surface holds. PARTLY: more lists may follow; where an invocation's pixels all show something,
// few of those reach them, so that they are blended now, and the others later.
#if TAKE
#define KEEPS_DISCS
#endif
#include "surfels/tiles/nearest.glsl"
#include "surfels/passes/limit.glsl"
#include "surfels/passes/look.glsl"
#include "surfels/passes/store.glsl"
#include "common/split.glsl"
#if LOCAL
layout(std430, binding = STORAGE_LOCAL_DEPTHS) writeonly buffer LocalDepths { uint local_depths[]; };
#endif

// A float holds the sums of so many discs exactly, an integer those of a whole list (TileLists): the order of a
// tile's list, which changes from frame to frame, does not show.
const int BLOCK = 128;

layout(binding = TEXTURE_DISC_LOOKS) uniform usamplerBuffer disc_looks;  // and radius, as stored
#if PARTLY
layout(std430, binding = STORAGE_FARTHEST) buffer Farthest { uint farthest[]; };  // as show.comp has it
#endif
#if LARGE
layout(binding = TEXTURE_COLOR_SUMS) uniform sampler2D color_sums;  // and weight
layout(binding = TEXTURE_NORMAL_SUMS) uniform sampler2D normal_sums;
#endif

float limit[PIXELS];
int total[PIXELS];
uvec3 light[PIXELS];
ivec3 normal[PIXELS];
vec3 visible[PIXELS];  // normals
#if LOCAL
float front[PIXELS], per_key[PIXELS];  // surfels/passes/layer.glsl
int layer_total[PIXELS];
#endif
float mask_scale;

#if TAKE
// What a disc gives; returns its radius, as stored. It lies by that of others in the tile.
float listed_look(uint disc, out vec3 rgb, out vec3 n) {
    uvec4 look = texelFetch(disc_looks, int(disc));
    unpack_look(look.xyz, rgb, n);
    return uintBitsToFloat(look.w);
}
#endif

// The same of a point, which lies anywhere.
float stored_look(uint row, out vec3 rgb, out vec3 n) {
    uvec2 look = texelFetch(looks, int(row)).xy;
    rgb = light_of(look);
    n = normal_of(look);
    return stored_radius(int(row));
}

// The same of the splat that a pixel shows.
float visible_look(int k, out vec3 rgb, out vec3 n) {
    bool is_shown = shown[k] != NOTHING;
#if TAKE
    bool is_listed = shown_discs[k] != NOTHING;
    float radius = listed_look(is_listed ? shown_discs[k] : 0u, rgb, n);
#if TAKE == 2
    vec3 other_rgb, other_n;
    float other = stored_look(is_shown && !is_listed ? shown[k] : 0u, other_rgb, other_n);
    rgb = is_listed ? rgb : other_rgb;
    n = is_listed ? n : other_n;
    radius = is_listed ? radius : other;
#endif
    return radius;
#else
    return stored_look(is_shown ? shown[k] : 0u, rgb, n);
#endif
}

void blend_block(usamplerBuffer list, int first, int last, int points_at) {
    float weight_sum[PIXELS];
    vec3 light_sum[PIXELS], normal_sum[PIXELS];
    for (int k = 0; k < PIXELS; ++k) {
        weight_sum[k] = 0.0;
        light_sum[k] = normal_sum[k] = vec3(0.0);
    }
    do {
        uvec4 found = reaching(list, first, last, points_at);
        do {
            bool is_there = found != uvec4(0u);
            uint number = begin_next(list, first, found);
            vec3 rgb, n;
            unpack_look(texelFetch(disc_looks, int(number)).xyz, rgb, n);
            for (int k = 0; k < PIXELS; ++k) {
                float y = down_at(k), here = key_at(k, y), form = form_at(k, y), edge = edge_of(here);
                bool counts = form <= edge && here >= limit[k] && is_there;
                // Rounding takes the form of a disc that is seen edge on below zero, where the mask has no bound.
                precise float fading = mask_scale * form / edge;
                float full = weight_at(max(fading, 0.0)), weight = counts ? full : 0.0;
                weight_sum[k] += weight;
                light_sum[k] += weight * rgb;
                normal_sum[k] += turned(weight, n, visible[k]) * n;
#if LOCAL
                layer_total[k] += int(weight * layer_steps(front[k], here, per_key[k]));
#endif
            }
        } while (found != uvec4(0u));
        first += RUN;
    } while (first < last);
    for (int k = 0; k < PIXELS; ++k) {
        total[k] += int(weight_sum[k]);
        light[k] += uvec3(light_sum[k]);
        normal[k] += ivec3(normal_sum[k]);
    }
}

void blend(usamplerBuffer list, ivec2 part, int points_at) {
    int first = part.x;
    do {
        blend_block(list, first, min(first + BLOCK, part.y), points_at);
        first += BLOCK;
    } while (first < part.y);
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
    take_nearest(listed, part, points_in_list());
#else
    take_nearest(away_listed, away_part, points_in_away_list());
#endif
    if (tile >= 0)
        for (int k = 0; k < PIXELS; ++k)
            if (in_picture(k)) store_pixel(k);
#endif
    mask_scale = 0.25 * falloff;
#if PARTLY
    bool is_closed = tile >= 0;
    uint most = 0u;
#endif
    // Without branches, in each of which Mesa would read the parameters anew.
    for (int k = 0; k < PIXELS; ++k) {
        total[k] = 0;
        light[k] = uvec3(0u);
        normal[k] = ivec3(0);
#if TAKE
        shown[k] = in_picture(k) ? shown[k] : NOTHING;
        float depth = uintBitsToFloat(depth_bits(k));
#else
        shown[k] = in_picture(k) ? rows[index_of(k)] : NOTHING;
        float depth = in_picture(k) ? abs(uintBitsToFloat(depths[index_of(k)])) : 0.0;
#endif
        bool is_shown = shown[k] != NOTHING;
        vec3 rgb;
        float radius = visible_look(k, rgb, visible[k]);
        float reach = epsilon * splat_radius(radius, depth);
#if LOCAL
        vec2 center = vec2(pixel + off(k)) + 0.5;
        reach = max(reach, layer_depth(visible[k], center));
        front[k] = stored_depth(is_shown ? depth : view_near);
        per_key[k] = steps_per_key(front[k], is_shown ? depth : view_near, visible[k], center);
        layer_total[k] = 0;
#endif
        precise float behind = depth + reach;
        float least = stored_depth(behind);
        limit[k] = is_shown ? least : 1.0;
#if PARTLY
        is_closed = is_closed && (is_shown || !in_picture(k));
        most = max(most, in_picture(k) ? is_shown ? floatBitsToUint(behind) : NO_DEPTH : 0u);
#endif
#if LARGE
        vec4 sums = texelFetch(color_sums, pixel + off(k), 0);
        total[k] = int(sums.a);
        light[k] = uvec3(sums.rgb);
        vec4 sums_beside = texelFetch(normal_sums, pixel + off(k), 0);
        normal[k] = ivec3(sums_beside.xyz);
#if LOCAL
        layer_total[k] = int(sums_beside.a);
#endif
#endif
    }
#if PARTLY
    if (tile >= 0) atomicMax(farthest[tile], most);
    if (!is_closed) pass_over(part);
#endif
    blend(listed, part, points_in_list());
#if AWAY
    blend(away_listed, away_part, points_in_away_list());
#endif
#if PARTLY
    if (!is_closed) return;
#else
    if (tile < 0) return;
#endif
    for (int k = 0; k < PIXELS; ++k)
        if (shown[k] != NOTHING) {
            uint count = uint(max(total[k], 1));
            vec3 mean_light = means_of(light[k], count), mean_normal = means_of(normal[k], count);
            vec3 rgb, n;
            visible_look(k, rgb, n);
#if LOCAL
            float steps = means_of(ivec3(layer_total[k], 0, 0), count).x;
            local_depths[index_of(k)] = floatBitsToUint(depth_of_steps(front[k], steps, per_key[k]));
#endif
            store_mean(index_of(k), mean_light, mean_normal, total[k] > 0, 1.0, rgb, visible[k]);
        }
}
