// What one view sees of the surface that pixels show, and how it competes there: the weights of all views, and the merged
// picture without bands, become those of the views before it and this one.
// CRISP: the picture is of the view of the largest weight, the mean of those that tie; else all count by their weights. Means
// are of what bands are of, so that differences to them sum to nothing.
// FINE: of four places in each pixel where samples lie closer than pixels.
// A pixel has the sum of the weights (merged, alpha), the largest, and of how many views that is (winners, two halves).
#include "common/color.glsl"
#include "common/item.glsl"
#include "common/list.glsl"
#include "pyramidal/seen.glsl"
#include "pyramidal/of_views.glsl"
#include "laplacian/pictures.glsl"
#include "laplacian/fitting.glsl"

layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;  // pixels
layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;  // of the nearest view's surface
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
#if COLOR
layout(binding = TEXTURE_OWN_COLORS) uniform samplerBuffer own_colors;
#endif
layout(binding = TEXTURE_OWN_NORMALS) uniform samplerBuffer own_normals;
layout(std430, binding = STORAGE_VIEW_PICTURE) writeonly buffer Picture { uvec2 picture[]; };
layout(std430, binding = STORAGE_MERGED) buffer Merged { vec4 merged[]; };
layout(std430, binding = STORAGE_WINNERS) buffer Winners { uvec4 winners[]; };

uniform int number;  // of the view
uniform bool first;  // of the views

const int AWAY = 4;  // samples: how far around a place an edge of its mask, or of its surface, counts
const ivec2 RING[] = ivec2[](ivec2(4, 0), ivec2(3, 3), ivec2(0, 4), ivec2(-3, 3), ivec2(-4, 0), ivec2(-3, -3), ivec2(0, -4), ivec2(3, -3));

// How well a view sees a place (Farooq, GRAPP 2009, eq. 1): mask, confidence, and how it faces the pod. The mask falls
// towards its edges.
float competition_weight(float mask, float confidence, float cosine) { return mask * confidence * max(cosine, 0.0); }

// What of the surroundings of a place its view sees, of the same surface: 1 inside, a half at a mask's edge.
float mask_around(RangeView v, int level, ivec2 uv) {
    RangeLevel range = range_level(v, level);
    float depth = sample_depth(sample_index(range, uv));
    float reach = STEEPEST * float(AWAY) * sample_spacing(v, level, depth);
    int seen = 0;
    for (int k = 0; k < RING.length(); ++k) {
        ivec2 at = uv + RING[k];
        bool inside = all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, range.size));
        int index = sample_index(range, inside ? at : uv);
        seen += int(inside && is_sample(index) && abs(sample_depth(index) - depth) <= reach);
    }
    return float(seen) / float(RING.length());
}

#if COLOR
#if FINE
// The mean of what a quarter of a pixel each shows, of the level that fits those.
void look_closer(RangeView v, int level, int at, vec3 place, vec3 normal, inout vec3 color) {
    vec3 sum = vec3(0.0);
    int count = 0;
    for (int k = 0; k < 4; ++k) {
        vec3 on_ray = from_pixel(vec2(split(at, view_size.x)) + 0.25 + 0.5 * vec2(k & 1, k >> 1), -place.z);
        vec3 ray = view_perspective ? on_ray / -place.z : vec3(0.0, 0.0, -1.0);
        float steep = dot(normal, ray);
        if (steep < -0.05) on_ray += ray * dot(normal, place - on_ray) / steep;
        LookedUp part;
        if (!look_up(v, level, on_ray, normal, tolerance, part)) continue;
        sum += part.color;
        ++count;
    }
    if (count > 0) color = sum / float(count);
}
#else
const float OF_A_PIXEL = 0.5 * log2(3.0);

// The mean over a pixel. One between four samples is as wide where they are 1 / sqrt(3) pixels apart (the square box and the
// tent of s have the variance s^2 / 4, a pixel 1 / 12); else of two levels, mixed so that it is.
void look_between(RangeView v, int level, float fits, vec3 place, vec3 normal, inout vec3 color) {
    int finer = int(floor(fits - OF_A_PIXEL)), other = finer == level ? level + 1 : finer;
    LookedUp found;
    if (finer < first_level || other > last_level || !look_up(v, other, place, normal, tolerance, found)) return;
    float apart = exp2(float(finer) - fits);  // pixels
    float coarse = (1.0 / (3.0 * apart * apart) - 1.0) / 3.0;
    color = mix(color, found.color, other == finer ? 1.0 - coarse : coarse);
}
#endif

// A cubic between 4 x 4 samples of the finest level (Catmull and Rom 1974), where all are of the surface of the nearest.
void look_smoother(RangeView v, vec2 pixel, ivec2 nearest, inout vec3 color) {
    RangeLevel range = range_level(v, 0);
    vec2 uv = pixel_to_level(v, 0, pixel);
    ivec2 first = ivec2(floor(uv)) - 1;
    if (any(lessThan(first, ivec2(0))) || any(greaterThanEqual(first + 3, range.size))) return;
    vec2 t = uv - floor(uv);
    vec2 weights[] = vec2[](
        t * (-0.5 + t * (1.0 - 0.5 * t)),
        1.0 + t * t * (-2.5 + 1.5 * t),
        t * (0.5 + t * (2.0 - 1.5 * t)),
        t * t * (-0.5 + 0.5 * t)
    );
    float depth = sample_depth(sample_index(range, nearest));
    float reach = STEEPEST * float(AWAY) * sample_spacing(v, 0, depth);
    vec3 sum = vec3(0.0);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
            int index = sample_index(range, first + ivec2(x, y));
            vec4 look = sample_look(index);
            if (look.a == 0.0 || abs(sample_depth(index) - depth) > reach) return;
            sum += weights[x].x * weights[y].y * to_linear(look.rgb);
        }
    color = max(sum, 0.0);
}
#endif

void main() {
    uint n = item();
    if (n >= list_count) return;
    int i = int(texelFetch(listed, int(n)).r);
    float depth = uintBitsToFloat(texelFetch(depths, i).r);
    uint row = texelFetch(rows, i).r;
    bool own = sample_of_id(row, RANGE_COUNT).x == number;
    vec3 place = from_pixel(vec2(split(i, view_size.x)) + 0.5, depth);
    vec3 seen_normal = texelFetch(own_normals, i).xyz;
    vec3 normal = mat3(world_to_view) * seen_normal;
    RangeView v = range_view(number);
    float fits = level_that_fits(v, place, depth);
    int level = clamp(int(floor(fits)), first_level, last_level);
    LookedUp found;
    float weight = 0.0;
    if (look_up(v, level, place, normal, tolerance, found)) {
        weight = competition_weight(mask_around(v, level, found.nearest), found.alpha, found.cosine);
#if COLOR
        if (fits < -0.5) look_smoother(v, found.pixel, found.nearest, found.color);
#if FINE
        int closer = clamp(int(floor(fits - 1.0)), first_level, last_level);  // samples are half a pixel apart
        if (fits > 0.5) look_closer(v, closer, i, place, normal, found.color);
#else
        look_between(v, level, fits, place, normal, found.color);
#endif
    } else if (own) {
        found.color = to_linear(texelFetch(own_colors, i).rgb);
#endif
    }
    if (own) weight = max(weight, LEAST_WEIGHT);
    weight = rounded_weight(weight);
    picture[i] = pack_seen_by(found.color, weight);
    vec4 so_far = first ? vec4(0.0) : merged[i];
    vec2 best = first ? vec2(0.0) : unpackHalf2x16(winners[i].x);
    bool better = weight > best.x;
    if (first || better) {
        float steep = dot(normal, view_perspective ? place / depth : vec3(0.0, 0.0, -1.0));
        if (better && !own) {
            if (steep < -0.05) depth += found.ahead * dot(normal, direction_to_pod(v, place)) / steep;
            row = sample_id(v, measured_under(v, level, found.nearest, found.pixel));
            vec3 its = normal_of(v, sample_index(range_level(v, level), found.nearest));
            if (its != vec3(0.0)) seen_normal = along_pose(its);
        }
        if (seen_normal != vec3(0.0)) seen_normal = normalize(seen_normal);
        winners[i] = uvec4(packHalf2x16(vec2(weight, 1.0)), floatBitsToUint(depth), row, pack_normal(seen_normal));
    } else if (weight > 0.0 && weight == best.x) winners[i].x = packHalf2x16(best + vec2(0.0, 1.0));
#if CRISP
    float part = better ? 1.0 : weight > 0.0 && weight == best.x ? 1.0 / (best.y + 1.0) : 0.0;
#else
    float part = weight > 0.0 ? weight / (so_far.a + weight) : 0.0;
#endif
    vec3 color = part == 1.0 ? found.color : from_banded(mix(to_banded(so_far.rgb), to_banded(found.color), part));
    merged[i] = vec4(color, so_far.a + weight);
}
