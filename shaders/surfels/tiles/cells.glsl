// A disc's cells are the tiles that it reaches, and behind all of these its home, one for each tile. Here they are counted.
// Then points are listed by homes (surfels/tiles/homes.glsl), and in the order of these lists discs by tiles
// (surfels/tiles/discs.glsl): points are read from anywhere, but discs that lie together in the picture do so in memory.
// Large discs, and those that cross the near plane, are listed to be rasterised; those of up to FEW pixels are sent to
// these at once, and are in no list. Points whose discs are listed, and those that are left to a second filling, are noted, so
// that no pass goes over the others again.
// SIDE 0: all discs; 1: those that face the eye; 2: the others that 1 found, where `farthest` does not hide them;
// 3: all that it does not hide.
#include "surfels/tiles/reach.glsl"
#if SIDE != 2
#include "amplify/texels.glsl"
#include "surfels/pixels.glsl"
#endif
#include "surfels/tiles/filled.glsl"

layout(std430, binding = STORAGE_NOTED) writeonly buffer Noted { uint noted[]; };
#if SIDE != 2
layout(std430, binding = STORAGE_REACH) writeonly buffer Reach { uvec2 reach[]; };
layout(std430, binding = STORAGE_LARGE) writeonly buffer Large { uint large[]; };
#if FEW
layout(std430, binding = STORAGE_NEAREST) buffer Nearest { uint nearest_depths[]; };  // of each pixel, float bits
#endif
#else
layout(binding = TEXTURE_REACH) uniform usamplerBuffer reach;
#endif
#if SIDE >= 2
layout(binding = TEXTURE_FARTHEST) uniform usamplerBuffer farthest;  // depth that counts in each tile, float bits
#endif
// Of discs that face away: the point; the nearest depth that it may reach, float bits.
#if SIDE == 1
layout(std430, binding = STORAGE_AWAY) writeonly buffer Away { uvec2 away_points[]; };
#elif SIDE == 2
layout(binding = TEXTURE_AWAY) uniform usamplerBuffer away_points;
#endif

void count_visits(ivec4 t) {
    visit(home_of(t.xy), 0u, 0u);
    ivec2 tile = t.xy;
    do {
        visit(cell_of(tile), 0u, 0u);
        tile = next_tile(tile, t);
    } while (tile.y < t.w);
}

#if SIDE >= 2
// Whether all pixels of these tiles show something nearer.
bool is_hidden(ivec4 t, float nearest) {
    ivec2 tile = t.xy;
    bool hidden = true;
    // Mesa may go on with what is left a loop with, as long as invocations beside do: nothing then changes it.
    do {
        hidden = hidden && (tile.y >= t.w || uintBitsToFloat(texelFetch(farthest, int(cell_of(tile))).r) < nearest);
        tile = next_tile(tile, t);
    } while (hidden && tile.y < t.w);
    return hidden;
}
#endif

#if SIDE != 2
void take_pixel(uint pixel, uint depth, uint row) {
#if FEW
    atomicMin(nearest_depths[pixel], depth);
#endif
}

// Parts that have these pixels: first, and the one after the last.
ivec4 parts_of(ivec4 pixels) {
    if (any(greaterThanEqual(pixels.xy, pixels.zw))) return ivec4(0);
    return ivec4(pixels.xy / PART, (pixels.zw + PART - 1) / PART);
}

// Whether a disc that crosses the near plane, whose image in perspective no box holds, lies to one side of all that the eye
// sees: around an eye within a pose most of them do. farthest: the depth up to which it may reach.
bool is_beside(float farthest) {
    vec2 across = vec2(disc_center.x, -disc_center.y) * view_scale;
    vec2 edge = mix(view_center, vec2(view_size) - view_center, greaterThan(across, vec2(0.0)));
    float reach = 1.001 * sqrt(disc_area) * view_scale;
    return any(greaterThan(0.99999 * abs(across), reach + max(edge * view_near, edge * farthest)));
}

// The parts of tiles that a point's disc reaches, in words. away_depth: as in `away_points`; 0 where it faces the eye.
uvec2 parts_reached(Point point, out uint away_depth) {
    away_depth = 0u;
    if (!begin_disc(point)) return uvec2(0u);
    vec2 depths = disc_range();
    if (depths.y < view_near || depths.x > view_far) return uvec2(0u);
    bool crosses = depths.x < view_near, has_box = !crosses || !view_perspective;
    if (!has_box && is_beside(depths.y)) return uvec2(0u);
    ivec4 pixels = has_box ? pixels_in(disc_box()) : ivec4(0, 0, view_size), parts = parts_of(pixels), t = tiles_of(parts);
    if (t.x >= t.z) return uvec2(0u);
    if (crosses || any(greaterThan(pixels.zw - pixels.xy, ivec2(SPAN)))) {
        large[atomicAdd(fillings[0].large_count, 1u)] = point.row;
        return uvec2(0u);
    }
#if SIDE == 1
    bool is_away = dot(disc_normal, towards_eye(disc_center)) <= 0.0;
#else
    const bool is_away = false;
#endif
#if FEW
    if (!is_away && (pixels.z - pixels.x) * (pixels.w - pixels.y) <= FEW) {
        take_pixels(pixels, point.row);
        atomicAdd(fillings[0].sent, 1u);
        return uvec2(SENT, 0u);
    }
#endif
    float nearest = depths.x * (1.0 - 1e-6);
#if SIDE == 1
    away_depth = is_away ? floatBitsToUint(nearest) : 0u;
#elif SIDE == 3
    if (is_hidden(t, nearest)) return uvec2(0u);
#endif
    return packed_parts(parts);
}

// at: the place of the disc among those of its side.
void note(uint i, uvec2 words, bool is_away, uint away_depth, uint at) {
#if SIDE == 1
    if (is_away) {
        away_points[at] = uvec2(i, away_depth);
        return;
    }
#endif
    noted[at] = i;
    count_visits(tiles_of(unpacked_parts(words)));
}

#if TOGETHER
#include "common/meet.glsl"

shared uint group_discs[2], group_slots[2];

// One invocation of a work group takes the places of all: millions of atomics on one word would wait for each other.
void scatter(uint i, bool exists) {
    uint me = gl_LocalInvocationID.x, away_depth = 0u, at = 0u;
    uvec2 words = uvec2(0u);
    if (me < 2u) group_discs[me] = 0u;
    meet();
    if (exists) {
        words = parts_reached(texel_point(drawn_row(int(i))), away_depth);
        reach[i] = words;
    }
    bool is_listed = words.y != 0u, is_away = away_depth != 0u;
    uint side = is_away ? 1u : 0u;
    if (is_listed) at = atomicAdd(group_discs[side], 1u);
    meet();
    if (me < 2u) group_slots[me] = atomicAdd(fillings[0].discs[me], group_discs[me]);
    meet();
    if (is_listed) note(i, words, is_away, away_depth, group_slots[side] + at);
}
#else
void scatter(uint i) {
    uint away_depth;
    uvec2 words = parts_reached(texel_point(drawn_row(int(i))), away_depth);
    reach[i] = words;
    if (words.y == 0u) return;
    bool is_away = away_depth != 0u;
    // One for both, as Mesa runs through both sides of a branch. By a variable: NVIDIA's compiler fails where a constructor
    // is in the index of what an atomic changes.
    uint side = is_away ? 1u : 0u, at = atomicAdd(fillings[0].discs[side], 1u);
    note(i, words, is_away, away_depth, at);
}
#endif
#else
void scatter(uint at) {
    if (at >= fillings[0].discs[1]) return;
    uvec2 point = texelFetch(away_points, int(at)).xy;
    ivec4 t = tiles_of(unpacked_parts(texelFetch(reach, int(point.x)).xy));
    if (is_hidden(t, uintBitsToFloat(point.y))) return;
    noted[atomicAdd(fillings[1].discs[0], 1u)] = point.x;
    count_visits(t);
}
#endif
