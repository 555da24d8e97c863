// A target of the one before; FIRST: of the picture. Samples that fall into a pixel fall into the cell that it lies in,
// so that the least of four is what a scatter of all samples into the coarser target keeps. <source> says what a sample
// is; COLOR, NORMAL, VALUE: which channels there are; POLYGONS: a pixel's own centre is where its sample is.
#include "common/view.glsl"
#include "common/item.glsl"
#include "common/split.glsl"
#include "pyramidal/targets.glsl"
#include <params>
#include "pyramidal/seen.glsl"
#if FIRST
#include "common/color.glsl"
#include <source>
#if COLOR
layout(binding = TEXTURE_OWN_COLORS) uniform samplerBuffer own_colors;
#endif
#if NORMAL
layout(binding = TEXTURE_OWN_NORMALS) uniform samplerBuffer own_normals;
#endif
#if VALUE
layout(binding = TEXTURE_OWN_VALUES) uniform samplerBuffer own_values;
#endif
#endif

layout(binding = TEXTURE_KEYS) uniform usamplerBuffer keys;
layout(binding = TEXTURE_BEST) uniform usamplerBuffer best;
#if !FIRST
layout(binding = TEXTURE_SPOTS) uniform samplerBuffer spots;
#endif
layout(binding = TEXTURE_SHOWN) uniform usamplerBuffer shown;
layout(std430, binding = STORAGE_KEYS) writeonly buffer Keys { uint out_keys[]; };
layout(std430, binding = STORAGE_BEST) writeonly buffer Best { uint out_best[]; };
layout(std430, binding = STORAGE_SPOTS) writeonly buffer Spots { vec2 out_spots[]; };
layout(std430, binding = STORAGE_SHOWN) writeonly buffer Shown { uvec4 out_shown[]; };

uniform int level;  // that is made

void main() {
    int i = int(item());
    ivec2 size = target_size(view_size, level), finer = target_size(view_size, level - 1);
    if (i >= size.x * size.y) return;
    int start = FIRST != 0 ? 0 : target_start(view_size, level - 1), from = -1;
    ivec2 cell = split(i, size.x);
    uint key = NO_DEPTH, lowest = NOTHING, filled = 0u;
    for (int k = 0; k < 4; ++k) {
        ivec2 at = 2 * cell + ivec2(k & 1, k >> 1);
        if (any(greaterThanEqual(at, finer))) continue;
        int there = start + at.y * finer.x + at.x;
        uint other_key = texelFetch(keys, there).r, other = texelFetch(best, there).r;
        if (other_key == NO_DEPTH) continue;
        filled += FIRST != 0 ? 1u : count_filled(texelFetch(shown, there));
        if (other_key > key || other_key == key && other >= lowest) continue;
        key = other_key;
        lowest = other;
        from = there;
    }
    int place = target_start(view_size, level) + i;
    out_keys[place] = key;
    out_best[place] = lowest;
    if (level <= density) filled = min(filled, 1u);
    uvec4 words = uvec4(0u);
    if (from >= 0) {
#if FIRST
        Seen seen = UNSEEN;
#if COLOR
        seen.color = to_linear(texelFetch(own_colors, from).rgb);
#endif
#if NORMAL
        seen.normal = texelFetch(own_normals, from).xyz;
#endif
#if VALUE
        seen.value = texelFetch(own_values, from).r;
#endif
        words = pack_seen(seen);
#if POLYGONS
        out_spots[place] = vec2(split(from, view_size.x)) + 0.5;
#else
        out_spots[place] = to_pixel(place_of(lowest));
#endif
#else
        words = texelFetch(shown, from);
        out_spots[place] = texelFetch(spots, from).xy;
#endif
    }
    out_shown[place] = with_filled(words, filled);
}
