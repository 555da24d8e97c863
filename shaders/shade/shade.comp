// From a Surface to a picture: colour, light, eye-dome lighting, background.
// COLOR_BY 0 plain, 1 own, 2 normal, 3 value, 4 id. LIGHT 0 flat, 1 head, 2 fixed.
// OWN_COLOR, OWN_NORMAL, OWN_VALUE: the backend wrote it for each pixel; else each row has it, and pixels that were
// filled have none. TURNED: the pose is, so that its axes are not the world's. With its colour comes how much of the pixel is covered; the rest is background.
// LEVEL_COLORS: how many colours there are of filled levels, in place of the colour map; 0: pixels are not coloured by level.
// BY_LOG: the colour map goes by the logarithm of the value. SAMPLES: rows are samples of range views, whose colours or normals are read.
// One invocation for each slot of the list of pixels that show something; the others hold the background already.
#include "common/view.glsl"
#include "common/color.glsl"
#include "common/item.glsl"
#include "common/list.glsl"
// picture/shade.py.
#include <params>

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;  // float bits, +inf where nothing is
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
layout(binding = TEXTURE_COLORS) uniform samplerBuffer colors;
layout(binding = TEXTURE_NORMALS) uniform samplerBuffer normals;
layout(binding = TEXTURE_VALUES) uniform samplerBuffer values;
layout(binding = TEXTURE_COLOR_MAP) uniform samplerBuffer color_map;
layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
layout(binding = TEXTURE_IDS) uniform usamplerBuffer ids;
#if OWN_COLOR
layout(binding = TEXTURE_OWN_COLORS) uniform samplerBuffer own_colors;
#endif
#if OWN_LEVEL
layout(binding = TEXTURE_LEVELS) uniform usamplerBuffer levels;
#endif
#if SAMPLES
#include "range/of_rows.glsl"
#endif
layout(std430, binding = STORAGE_PICTURE) writeonly buffer Picture { uint picture[]; };

float depth_at(ivec2 pixel) {
    return uintBitsToFloat(texelFetch(depths, pixel.y * view_size.x + pixel.x).r);
}

vec3 base_color(int index, uint row, float depth, vec3 normal) {
#if COLOR_BY == 0
    return plain.rgb;
#elif COLOR_BY == 2
#if TURNED
    normal = mat3(to_world) * normal;
#endif
    return 0.5 * normal + 0.5;
#else
#if !(COLOR_BY == 1 && OWN_COLOR) && !(COLOR_BY == 3 && (OWN_VALUE || VALUE == 0))
    if (row == NOTHING) return plain.rgb;
#endif
#if COLOR_BY == 1 && SAMPLES && !OWN_COLOR
    return sample_color(row);
#elif COLOR_BY == 1
    return texelFetch(colors, OWN_COLOR != 0 ? index : int(row)).rgb;
#elif COLOR_BY == 3
#if OWN_VALUE
    float value = texelFetch(values, index).r;
#elif VALUE == 0
    float value = depth;
#elif VALUE == 1
    float value = dot(height_axis.xyz, texelFetch(positions, int(row)).xyz);
#else
    float value = texelFetch(values, int(row)).r;
#endif
    if (isnan(value)) return plain.rgb;
#if BY_LOG
    value = value > 0.0 ? log2(value) : value_range.x;
#endif
    float t = (value - value_range.x) / max(value_range.y - value_range.x, 1e-30);
    return texelFetch(color_map, int(clamp(t, 0.0, 1.0) * 255.0 + 0.5)).rgb;
#else
#if HAS_IDS
    uint id = texelFetch(ids, int(row)).r;
#else
    uint id = row;
#endif
    // Knuth's multiplicative hash: neighbouring ids get colours far apart.
    uint h = id * 2654435761u;
    h ^= h >> 16;
    return vec3(64u + (uvec3(h, h >> 8, h >> 16) & 127u) * 3u / 2u) / 255.0;
#endif
#endif
}

#if LEVEL_COLORS
// Grey where the pixel was measured; color: of what it shows.
vec3 level_color(int index, uint row, vec3 color) {
    uint level = uint(row == NOTHING);
#if OWN_LEVEL
    level = max(level, texelFetch(levels, index).r);
#endif
    if (level == 0u) return to_srgb(vec3(dot(to_linear(color), vec3(0.2126, 0.7152, 0.0722))));
    return texelFetch(color_map, int(min(level, uint(LEVEL_COLORS))) - 1).rgb;
}
#endif

// From what a pixel shows to the eye, view space.
vec3 eye_direction(ivec2 pixel, float depth) {
    return view_perspective ? -normalize(from_pixel(vec2(pixel) + 0.5, depth)) : vec3(0.0, 0.0, 1.0);
}

vec3 lit(vec3 color, ivec2 pixel, float depth, vec3 normal) {
#if LIGHT == 0
    return color;
#else
    vec3 to_eye = eye_direction(pixel, depth);
#if LIGHT == 1
    vec3 to_light = to_eye;
#else
    vec3 to_light = light.xyz;
#endif
    vec3 n = mat3(world_to_view) * normal;
    // A scan's normals need not agree in sign: light the side that is seen.
    n = dot(n, to_eye) < 0.0 ? -n : n;
    float facing = dot(n, to_light);
    float highlight = facing > 0.0 ? pow(max(dot(reflect(-to_light, n), to_eye), 0.0), phong.w) : 0.0;
    return color * (phong.x + phong.y * max(facing, 0.0)) + phong.z * highlight;
#endif
}

// Eye-dome lighting (Boucheny 2009): the obscurance by nearer neighbours, from depth alone.
float eye_dome(ivec2 pixel, float depth) {
    float sum = 0.0;
    for (int i = 0; i < 4; ++i) {
        ivec2 step = ivec2(i < 2 ? 1 - 2 * i : 0, i < 2 ? 0 : 5 - 2 * i) * eye_dome_radius;
        float other = depth_at(clamp(pixel + step, ivec2(0), view_size - 1));
        sum += max(0.0, 1.0 - (other + view_base) / (depth + view_base));
    }
    return exp(-50.0 * eye_dome_strength * sum);
}

vec3 shade(int index) {
    ivec2 pixel = ivec2(index % view_size.x, index / view_size.x);
    uint row = texelFetch(rows, index).r;
    float depth = uintBitsToFloat(texelFetch(depths, index).r);
    vec3 normal = vec3(0.0);
#if LIGHT != 0 || COLOR_BY == 2
#if SAMPLES && !OWN_NORMAL
    if (row != NOTHING) normal = normal_of_sample(row);
#else
    if (OWN_NORMAL != 0 || row != NOTHING) normal = texelFetch(normals, OWN_NORMAL != 0 ? index : int(row)).xyz;
#endif
    float len = length(normal);
    // A missing normal faces the eye.
    normal = len > 0.0 && len < UNKNOWN
        ? normal / len : transpose(mat3(world_to_view)) * eye_direction(pixel, depth);
#endif
    vec3 color = base_color(index, row, depth, normal);
#if LEVEL_COLORS
    color = level_color(index, row, color);
#endif
#if LIGHT != 0 || EYE_DOME
    color = lit(to_linear(color), pixel, depth, normal);
#if EYE_DOME
    color *= eye_dome(pixel, depth);
#endif
    color = to_srgb(color);
#endif
    return color;
}

#if OWN_COLOR
// sRGB, as pictures are put on a page.
vec4 over_background(vec4 color, float coverage) {
    float alpha = mix(background.a, 1.0, coverage);
    vec3 mixed = mix(background.rgb * background.a, color.rgb, coverage);
    return vec4(mixed / max(alpha, 1e-6), alpha);
}
#endif

void main() {
    uint i = item();
    // All variants read the view: of those that did not, Mesa's Zink (22.3.6) took the view for the params, after
    // other programs had read it.
    if (i >= list_count || view_size.x == 0) return;
    uint pixel = list[i];
    if (pixel == NOTHING) return;
    vec4 color = vec4(shade(int(pixel)), 1.0);
#if OWN_COLOR
    color = over_background(color, texelFetch(own_colors, int(pixel)).a);
#endif
    picture[pixel] = packUnorm4x8(color);
}
