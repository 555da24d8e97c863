// Samples of range views. POLYGONS: a pixel shows a triangle between samples, else a sample. BLEND 0 the nearest view's,
// 1 all views that see the same surface, 2 the best of these. FADE: finer levels fade into coarser ones as their samples
// come to lie closer than pixels.
#include <params>
#include "pyramidal/views/grid.glsl"

#if NORMAL || BLEND
layout(binding = TEXTURE_RANGE_NORMALS) uniform usamplerBuffer range_normals;
#endif
#if VALUE
layout(binding = TEXTURE_VALUES) uniform samplerBuffer values;
#endif

vec3 place_of(uint row) {
    ivec4 at = sample_of_id(row, RANGE_COUNT);
    RangeView v = range_view(at.x);
    return to_screen_view(v, sample_place(v, 0, vec2(at.zw), sample_depth(sample_index(v, 0, at.zw))));
}

// Whether samples are near to each other in one range image, and of one surface there (Farooq 2013, algorithm 6.5).
bool are_neighbors(uint row, uint other, int most) {
    ivec4 here = sample_of_id(row, RANGE_COUNT), there = sample_of_id(other, RANGE_COUNT);
    int apart = max(abs(here.z - there.z), abs(here.w - there.w));
    if (here.x != there.x || apart > most) return false;
    RangeView v = range_view(here.x);
    float depth = sample_depth(sample_index(v, 0, here.zw)), beside = sample_depth(sample_index(v, 0, there.zw));
    return abs(depth - beside) <= STEEPEST * float(max(apart, 1)) * sample_spacing(v, 0, min(depth, beside));
}

// A unit normal along the pose's axes of one in screen view space.
vec3 along_pose(vec3 normal) { return normal * mat3(world_to_view); }

// The sample of the first level at a pixel coordinate, or else the one nearest to it among those that (u, v) of a level
// was made of.
ivec2 measured_under(RangeView v, int level, ivec2 uv, vec2 pixel) {
    if (level == 0) return uv;
    ivec2 there = clamp(ivec2(floor(pixel)), ivec2(0), v.size - 1);
    if (is_sample(sample_index(v, 0, there))) return there;
    int reach = v.centered ? 3 : 2;
    for (; level > 0; --level) {
        RangeLevel finer = range_level(v, level - 1);
        float least = 1e30;
        ivec2 chosen = min(2 * uv, finer.size - 1);
        for (int k = 0; k < reach * reach; ++k) {
            ivec2 at = 2 * uv + (reach == 2 ? ivec2(k & 1, k >> 1) : ivec2(k % 3, k / 3) - 1);
            if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, finer.size))) continue;
            vec2 apart = level_to_pixel(v, level - 1, vec2(at)) - pixel;
            if (dot(apart, apart) >= least || !is_sample(sample_index(finer, at))) continue;
            least = dot(apart, apart);
            chosen = at;
        }
        uv = chosen;
    }
    return uv;
}

vec3 normal_of(RangeView v, int index) {
#if NORMAL || BLEND
#if RANGE_WIDE
    uint word = texelFetch(range_normals, index >> 2)[index & 3];
#else
    uint word = texelFetch(range_normals, index).r;
#endif
    return word == 0u ? vec3(0.0) : turned(v.screen, unpack_normal(word));
#else
    return vec3(0.0);
#endif
}

// What a pixel shows: a mix of up to three samples of a level of a view. shares: sum 1. uv: the place between them.
// nearest: the sample with the largest share. facing: the normal of the triangle, 0 where it is a sample alone.
// apart: pixels between neighbouring samples.
struct Mixture {
    vec3 shares;
    ivec3 index;
    vec2 uv;
    ivec2 nearest;
    vec3 facing;
    float apart;
};

#if POLYGONS
Mixture mixed_of(RangeView v, ivec4 at, uint part, vec2 pixel) {
    RangeLevel found = range_level(v, at.y);
    // Corners in the order of the quad's, without the one that the triangle lacks.
    ivec2 x_at = part == 0u ? ivec2(1, 0) : ivec2(0), z_at = part == 3u ? ivec2(0, 1) : ivec2(1);
    ivec2 y_at = part < 2u ? ivec2(0, 1) : ivec2(1, 0);
    Corner x = corner_at(v, found, at.y, at.zw + x_at), y = corner_at(v, found, at.y, at.zw + y_at);
    Corner z = corner_at(v, found, at.y, at.zw + z_at);
    vec3 shares = shares_at(x, y, z, pixel);
    float apart = sqrt(abs(shares.x + shares.y + shares.z));  // a triangle is half a square
    shares = shares_in_space(depths_of(x, y, z), shares);
    bool first = shares.x >= max(shares.y, shares.z);
    ivec2 most = first ? x_at : shares.y >= shares.z ? y_at : z_at;
    return Mixture(
        shares,
        ivec3(x.index, y.index, z.index),
        vec2(at.zw) + shares.x * vec2(x_at) + shares.y * vec2(y_at) + shares.z * vec2(z_at),
        at.zw + most,
        cross(y.place - x.place, z.place - x.place),
        apart
    );
}
#endif

#if FADE && COLOR
const float FOG = 4.0;  // of a level whose samples are half a pixel apart, 2 % are left

// Linear colour of a level at a pixel coordinate, between its samples; alpha: 0 where there are none.
vec4 color_at(RangeView v, int level, vec2 pixel) {
    RangeLevel found = range_level(v, level);
    vec2 uv = clamp(pixel_to_level(v, level, pixel), vec2(0.0), vec2(found.size - 1));
    ivec2 first = ivec2(uv);
    vec2 part = uv - vec2(first);
    vec4 sum = vec4(0.0);
    for (int k = 0; k < 4; ++k) {
        ivec2 at = min(first + ivec2(k & 1, k >> 1), found.size - 1);
        vec4 look = sample_look(sample_index(found, at));
        float share = ((k & 1) != 0 ? part.x : 1.0 - part.x) * ((k >> 1) != 0 ? part.y : 1.0 - part.y) * look.a;
        sum += share * vec4(to_linear(look.rgb), 1.0);
    }
    return sum.a > 0.0 ? vec4(sum.rgb / sum.a, 1.0) : vec4(0.0);
}
#endif

// The normal of a triangle towards its pod, in screen view space; zero where it has none.
vec3 triangle_normal(RangeView v, vec3 facing, vec3 place) {
    vec3 to_eye = v.kind == RANGE_HEIGHT ? turned(v.screen, vec3(0.0, 0.0, 1.0)) : to_screen_view(v, vec3(0.0)) - place;
    float size = length(facing);
    return size > 0.0 ? facing * (dot(facing, to_eye) < 0.0 ? -1.0 : 1.0) / size : vec3(0.0);
}

#if BLEND
const int AROUND = 3;       // levels above a sample's: how far from an edge of the mask it is told by its share there
const float AGREE = 4.0;    // how far apart depths of one surface may be that two views measured, in samples
const float LEAST_WEIGHT = 1e-3;

// Weight of a place of a view: of its mask and confidence, falling towards the mask's edges, and how it faces the pod
// (Farooq 2013, GRAPP 2009, eq. 1: S C V). cosine: of the normal and the direction to the pod.
float weight_of(RangeView v, int level, vec2 pixel, float cosine) {
    int coarse = min(level + AROUND, top_level);
    RangeLevel found = range_level(v, coarse);
    vec2 uv = clamp(pixel_to_level(v, coarse, pixel), vec2(0.0), vec2(found.size - 1));
    ivec2 first = ivec2(uv), last = min(first + 1, found.size - 1);
    vec2 part = uv - vec2(first);
    float low = mix(sample_look(sample_index(found, first)).a, sample_look(sample_index(found, ivec2(last.x, first.y))).a, part.x);
    float high = mix(sample_look(sample_index(found, ivec2(first.x, last.y))).a, sample_look(sample_index(found, last)).a, part.x);
    return clamp(2.0 * mix(low, high, part.y) - 1.0, 0.0, 1.0) * max(cosine, 0.0) * max(cosine, 0.0);
}

// What a view sees at a place. pixel: its coordinate there; nearest: the sample there, of the level that was looked at.
// cosine: of the surface's normal and the direction to the pod. ahead: how far the view's surface is from the place
// towards its pod. alpha: confidence, to the mask's edge.
struct LookedUp {
    vec2 pixel;
    ivec2 nearest;
    float cosine, ahead, alpha;
    vec3 color;
};

vec3 direction_to_pod(RangeView v, vec3 place) {
    return v.kind == RANGE_HEIGHT ? turned(v.screen, vec3(0.0, 0.0, 1.0)) : normalize(to_screen_view(v, vec3(0.0)) - place);
}

// Looks a place (screen view space) of a surface with a normal up in a view; false where that sees another surface there,
// more than `agree` samples away, or none.
bool look_up(RangeView v, int level, vec3 place, vec3 normal, float agree, out LookedUp found) {
    found = LookedUp(vec2(0.0), ivec2(0), dot(normal, direction_to_pod(v, place)), 0.0, 0.0, vec3(0.0));
    if (found.cosine <= 0.1) return false;
    vec3 projected = project_to(v, place);
    RangeLevel range = range_level(v, level);
    vec2 uv = pixel_to_level(v, level, projected.xy);
    if (!(all(greaterThanEqual(uv, vec2(0.0))) && all(lessThanEqual(uv, vec2(range.size - 1))))) return false;
    ivec2 first = min(ivec2(uv), range.size - 2);
    vec2 part = uv - vec2(first);
    if (any(lessThan(range.size, ivec2(2)))) return false;
    float depth = 0.0;
    float spacing_there = sample_spacing(v, level, projected.z);
    for (int k = 0; k < 4; ++k) {
        ivec2 at = first + ivec2(k & 1, k >> 1);
        int index = sample_index(range, at);
        float share = ((k & 1) != 0 ? part.x : 1.0 - part.x) * ((k >> 1) != 0 ? part.y : 1.0 - part.y);
        if (share == 0.0) continue;
        float there = sample_depth(index);
        vec4 look = sample_look(index);
        if (look.a == 0.0 || abs(there - projected.z) > (agree + 1.0 / found.cosine) * spacing_there) return false;
        depth += share * there;
        found.alpha += share * look.a;
#if COLOR
        found.color += share * to_linear(look.rgb);
#endif
    }
    found.pixel = projected.xy;
    found.nearest = ivec2(uv + 0.5);
    found.ahead = projected.z - depth;
    return abs(found.ahead) <= agree * spacing_there;
}

// What another view shows at a place of a surface with a normal; its weight, 0: nothing. ahead: how far its surface is from
// the place towards its pod.
float other_view(RangeView v, int level, vec3 place, vec3 normal, out float ahead, out Seen seen) {
    LookedUp found;
    bool sees = look_up(v, level, place, normal, AGREE, found);
    seen = Seen(found.color, vec3(0.0), 0.0);
    ahead = found.ahead;
    if (!sees) return 0.0;
#if NORMAL
    seen.normal = normal_of(v, sample_index(range_level(v, level), found.nearest));
#endif
    return weight_of(v, level, found.pixel, found.cosine);
}

// Blends what other views see of the surface that a pixel shows. normal: of it, screen view space, unit length.
void blend(int number, RangeView v, int level, vec2 pixel, vec3 place, vec3 normal, inout float depth, inout Seen seen) {
    float total = max(weight_of(v, level, pixel, dot(normal, direction_to_pod(v, place))), LEAST_WEIGHT);
    vec3 ray = view_perspective ? place / -place.z : vec3(0.0, 0.0, -1.0);
    float steep = dot(normal, ray), moved = 0.0;
#if BLEND == 1
    seen.color *= total;
    seen.normal *= total;
#endif
    for (int n = 0; n < RANGE_COUNT; ++n) {
        if (n == number) continue;
        RangeView other = range_view(n);
        float ahead;
        Seen there;
        float weight = other_view(other, level, place, normal, ahead, there);
        if (weight <= 0.0) continue;
        // Along the pixel's ray, as far as the other's surface is from this one.
        float change = ahead * dot(normal, direction_to_pod(other, place)) / steep;
#if BLEND == 1
        total += weight;
        moved += weight * change;
        seen.color += weight * there.color;
        seen.normal += weight * there.normal;
#else
        if (weight <= total) continue;
        total = weight;
        moved = change;
        seen.color = there.color;
        if (there.normal != vec3(0.0)) seen.normal = there.normal;
#endif
    }
#if BLEND == 1
    moved /= total;
    seen.color /= total;
#endif
    if (steep < -0.05) depth += moved;
}
#endif

// What a pixel shows. row: of the sample that it shows most of.
void own_pixel(ivec2 pixel, uint item_index, inout float depth, out uint row, out Seen seen) {
    int index = int(item_index / PARTS);
    ivec4 at = sample_at(index, RANGE_COUNT);
    RangeView v = range_view(at.x);
    Mixture shown = Mixture(vec3(1.0, 0.0, 0.0), ivec3(index), vec2(at.zw), at.zw, vec3(0.0), 1.0);
    vec2 middle = vec2(pixel) + 0.5;
#if POLYGONS
    uint part = item_index % PARTS;
    if (part != ALONE) shown = mixed_of(v, at, part, middle);
#endif
    row = sample_id(v, measured_under(v, at.y, shown.nearest, level_to_pixel(v, at.y, shown.uv)));
    seen = UNSEEN;
    for (int k = 0; k < (POLYGONS != 0 ? 3 : 1); ++k) {
#if COLOR
        seen.color += shown.shares[k] * to_linear(sample_look(shown.index[k]).rgb);
#endif
#if NORMAL || BLEND
        seen.normal += shown.shares[k] * normal_of(v, shown.index[k]);
#endif
    }
#if FADE && COLOR
    // The fog equation: the closer together samples are, the less is seen of them (7.3.2).
    float closer = max(1.0 / shown.apart - 1.0, 0.0);
    float fine = exp(-closer * closer * FOG);
    if (fine < 0.999 && at.y < last_level) {
        vec4 coarse = color_at(v, at.y + 1, level_to_pixel(v, at.y, shown.uv));
        seen.color = mix(seen.color, coarse.rgb, (1.0 - fine) * coarse.a);
    }
#endif
    vec3 place = from_pixel(middle, depth), normal = triangle_normal(v, shown.facing, place);
#if NORMAL || BLEND
    if (dot(seen.normal, seen.normal) > 1e-6) normal = normalize(seen.normal);
    seen.normal = normal;
#endif
#if BLEND
    if (normal != vec3(0.0)) blend(at.x, v, at.y, level_to_pixel(v, at.y, shown.uv), place, normal, depth, seen);
#endif
#if NORMAL
    if (seen.normal != vec3(0.0)) seen.normal = along_pose(normalize(seen.normal));
#endif
#if VALUE
    seen.value = texelFetch(values, int(row)).r;
#endif
}
