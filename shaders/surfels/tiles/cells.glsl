// A disc's cells are the tiles of TILE x TILE pixels that it reaches: found in PASS 0, remembered for PASS 1.
// Large discs, and those that cross the near plane, are listed to be rasterised; those of up to FEW pixels are sent to
// these at once, and are in no list.
// SIDE 0: all discs; 1: those that face the eye; 2: the others that 1 found, where `farthest` does not hide them;
// 3: all that it does not hide.
#include "surfels/tiles/grid.glsl"
#if PASS == 0 && SIDE != 2
#include "amplify/texels.glsl"
#include "surfels/pixels.glsl"
#endif

#if PASS == 0 && SIDE != 2
layout(std430, binding = STORAGE_PLACES) writeonly buffer Places { vec4 places[]; };
layout(std430, binding = STORAGE_FORMS) writeonly buffer Forms { vec4 forms[]; };
layout(std430, binding = STORAGE_REACH) writeonly buffer Reach { uint reach[]; };
layout(std430, binding = STORAGE_LARGE) buffer Large { uint large_count, list_length, away, longest, sent, large[]; };
#if FEW
layout(std430, binding = STORAGE_NEAREST) buffer Nearest { uint nearest_depths[]; };  // of each pixel, float bits
#endif
#else
layout(binding = TEXTURE_REACH) uniform usamplerBuffer reach;
#endif
#if PASS == 0 && SIDE >= 2
layout(binding = TEXTURE_FARTHEST) uniform usamplerBuffer farthest;  // depth that counts in each tile, float bits
#endif
#if SIDE == 1 || SIDE == 2
// Of discs that face away, the nearest depth that they may reach, float bits: of those that 2 lists alone, once that
// has counted them. 0: of others.
#if PASS == 0
layout(std430, binding = STORAGE_AWAY) writeonly buffer Away { uint away_depths[]; };
#endif
#if !(PASS == 0 && SIDE == 1)
layout(binding = TEXTURE_AWAY) uniform usamplerBuffer known_away_depths;
#endif
#endif

// First tile 11 + 11 bits, width and height 5 + 5: pictures up to 2048 tiles, discs up to 31.
const int SPAN = 31;

// First tile, and the one after the last.
ivec4 reached(uint word) {
    ivec2 first = ivec2(word & 0x7FFu, word >> 11 & 0x7FFu);
    return ivec4(first, first + ivec2(word >> 22 & 31u, word >> 27));
}

void visit_tiles(uint word, uint disc) {
    ivec4 t = reached(word);
    for (int y = t.y; y < t.w; ++y)
        for (int x = t.x; x < t.z; ++x) visit(uint(y * tiles.x + x), 0u, disc);
}

#if PASS == 0 && SIDE >= 2
// Whether all pixels of these tiles show something nearer.
bool is_hidden(ivec4 t, float nearest) {
    for (int y = t.y; y < t.w; ++y)
        for (int x = t.x; x < t.z; ++x)
            if (uintBitsToFloat(texelFetch(farthest, y * tiles.x + x).r) >= nearest) return false;
    return true;
}
#endif

#if PASS == 0 && SIDE != 2
void take_pixel(uint pixel, uint depth, uint row) {
#if FEW
    atomicMin(nearest_depths[pixel], depth);
#endif
}

// Tiles that have these pixels: first, and the one after the last.
ivec4 tiles_of(ivec4 pixels) {
    if (any(greaterThanEqual(pixels.xy, pixels.zw))) return ivec4(0);
    return ivec4(pixels.xy / TILE, (pixels.zw + TILE - 1) / TILE);
}

// The tiles that a disc reaches, as a word; its key and form are written down. disc: its number. away: as in
// `away_depths`.
uint tiles_reached(Point point, uint disc, out uint away_depth) {
    away_depth = 0u;
    if (!begin_disc(point)) return 0u;
    vec2 depths = disc_range();
    if (depths.y < view_near || depths.x > view_far) return 0u;
    bool crosses = depths.x < view_near;
    ivec4 pixels = crosses ? ivec4(0) : pixels_in(disc_box()), t = tiles_of(pixels);
    if (crosses || any(greaterThan(t.zw - t.xy, ivec2(SPAN)))) {
        large[atomicAdd(large_count, 1u)] = point.row;
        return 0u;
    }
    if (t.x >= t.z) return 0u;
#if SIDE == 1
    bool is_away = dot(disc_normal, towards_eye(disc_center)) <= 0.0;
#else
    const bool is_away = false;
#endif
#if FEW
    if (!is_away && (pixels.z - pixels.x) * (pixels.w - pixels.y) <= FEW) {
        take_pixels(pixels, point.row);
        atomicAdd(sent, 1u);
        return SENT;
    }
#endif
    float nearest = depths.x * (1.0 - 1e-6);
#if SIDE == 1
    if (is_away) {
        away = 1u;
        away_depth = floatBitsToUint(nearest);
    }
#elif SIDE == 3
    if (is_hidden(t, nearest)) return 0u;
#endif
    vec3 form, key = disc_key(form);
    places[disc] = vec4(to_pixel(disc_center), key.xy);
    forms[disc] = vec4(key.z, form);
    return uint(t.x | t.y << 11 | (t.z - t.x) << 22) | uint(t.w - t.y) << 27;
}
#endif

void scatter(uint i) {
#if PASS == 0 && SIDE != 2
    uint away_depth, word = tiles_reached(texel_point(drawn_row(int(i))), i, away_depth);
    reach[i] = word;
#if SIDE == 1
    away_depths[i] = away_depth;
    if (away_depth != 0u) return;
#endif
#else
#if SIDE == 1 || SIDE == 2
    uint away_depth = texelFetch(known_away_depths, int(i)).r;
    if ((away_depth != 0u) != (SIDE == 2)) return;
#endif
    uint word = texelFetch(reach, int(i)).r;
#if PASS == 0
    if (is_hidden(reached(word), uintBitsToFloat(away_depth))) {
        away_depths[i] = 0u;
        return;
    }
#endif
#endif
    visit_tiles(word, i);
}
