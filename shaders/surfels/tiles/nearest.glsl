// The invocations of listed tiles: each keeps the pixels of a part, and looks at the tile's discs. No atomics: the best
// depth and the lowest row at that depth stay in registers.
// MASKED: an entry of a list says which parts of the tile its disc reaches, and invocations pass over the others. Else each has
// a pixel, and a tile is a work group.
#include "surfels/tiles/grid.glsl"

// Mesa runs eight invocations at once that are neighbors along x.
layout(local_size_x = ALL_PARTS, local_size_y = TILES) in;

layout(binding = TEXTURE_CENTERS) uniform samplerBuffer centers;  // centre, pixels; key there; its step right
layout(binding = TEXTURE_FORMS) uniform samplerBuffer forms;   // the key's step down; a, b, c (surfels/disc.glsl)
layout(binding = TEXTURE_STARTS) uniform usamplerBuffer starts;  // of each tile's part of the list
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;  // discs, in any order; then their points
#if AWAY
// Of those that face away, which a second filling listed and whose numbers follow.
layout(binding = TEXTURE_AWAY_STARTS) uniform usamplerBuffer away_starts;
layout(binding = TEXTURE_AWAY_LISTED) uniform usamplerBuffer away_listed;
#endif
#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;
#endif
layout(binding = TEXTURE_WORK) uniform usamplerBuffer work;  // tiles that discs reach, after a dispatch and their number
layout(std430, binding = STORAGE_DEPTHS) buffer Depths { uint depths[]; };
layout(std430, binding = STORAGE_ROWS) buffer Rows { uint rows[]; };

// FILL: the best of pixels that stay as they are: nothing is better. No array of bool says which they are, as
// Mesa's Zink cannot read one (docs/how-it-works/surfels.md).
#define CLOSED uintBitsToFloat(NO_DEPTH)

const int PIXELS = PART_WIDTH * PART_HEIGHT;

float best[PIXELS];  // reversed depth-buffer values
uint shown[PIXELS];
#ifdef KEEPS_DISCS
uint shown_discs[PIXELS];  // of those that were found in lists
#endif
ivec2 pixel;         // the first of this invocation's

// -1: none, at the end of the last work group; its pixels are outside the picture.
int this_tile() {
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint at = group * TILES + gl_LocalInvocationID.y;
    int tile = at < texelFetch(work, 3).r ? int(texelFetch(work, int(at) + 4).r) : -1;
    ivec2 part = ivec2(gl_LocalInvocationID.x % COLUMNS, gl_LocalInvocationID.x / COLUMNS);
    pixel = (tile < 0 ? tiles : ivec2(tile % tiles.x, tile / tiles.x)) * TILE + part * PART;
    return tile;
}

// Where the point of disc 0 stands, or would stand, in a list.
int points_in_list() { return int(texelFetch(starts, tiles.x * tiles.y).r); }

#if AWAY
int points_in_away_list() {
    int count = tiles.x * tiles.y, discs = int(texelFetch(starts, 2 * count).r) - points_in_list();
    return int(texelFetch(away_starts, count).r) - discs;
}
#endif

// A tile's part of the list: first, and the one after the last.
ivec2 part_of(usamplerBuffer begins, int tile) {
    if (tile < 0) return ivec2(0);
    ivec2 part = ivec2(texelFetch(begins, tile).r, texelFetch(begins, tile + 1).r);
    return part.y - part.x > LONGEST ? ivec2(0) : part;  // is drawn once more, in another way
}

// at: where a disc's point stands in a list.
uint row_of(usamplerBuffer list, int at) {
    uint i = texelFetch(list, at).r;
#if SAMPLED
    i = texelFetch(drawn_rows, int(i)).r;
#endif
    return i;
}

// A disc's key and form at a pixel are the same numbers however pixels are shared out: `precise`.
struct Disc { float center_y, key_step, curve; };

Disc disc;
float column_key[PART_WIDTH], column_form[PART_WIDTH], column_skew[PART_WIDTH];  // along each column of pixels

void begin_columns(vec4 a, vec4 b) {
    disc = Disc(a.y, b.x, b.w);
    for (int k = 0; k < PART_WIDTH; ++k) {
        precise float x = float(pixel.x) + (0.5 + float(k)) - a.x;
        precise float key = a.z + a.w * x;
        precise float form = b.y * x * x;
        column_key[k] = key;
        column_form[k] = form;
        column_skew[k] = 2.0 * b.z * x;
    }
}

void begin_columns(uint number) { begin_columns(texelFetch(centers, int(number)), texelFetch(forms, int(number))); }

// Lists are gone through in runs of entries: which of them reach this invocation's pixels, a bit each. Loops end with
// their condition, as Mesa runs through a loop once more where it stands first.
#if MASKED
const int RUN = 128, AT_ONCE = 8;

uvec4 reaching(usamplerBuffer list, int first, int last, int points_at) {
    uint part = gl_LocalInvocationID.x + uint(DISC_BITS);
    uvec4 found = uvec4(0u);
    int i = 0, count = min(last - first, RUN);
    do {
        uint bits = 0u;
        for (int j = 0; j < AT_ONCE; ++j) bits |= (texelFetch(list, first + i + j).r >> part & 1u) << j;
        bits = count - i < AT_ONCE ? bits & (1u << max(count - i, 0)) - 1u : bits;
        found |= -uvec4(equal(ivec4(i >> 5), ivec4(0, 1, 2, 3))) & bits << (i & 31);
        i += AT_ONCE;
    } while (i < count);
    return found;
}

// Begins the first disc that was found in a run, which it takes out of these; returns its number.
uint begin_next(usamplerBuffer list, int first, inout uvec4 found) {
    bvec4 has = notEqual(found, uvec4(0u));
    uint word = has.x ? found.x : has.y ? found.y : has.z ? found.z : found.w, rest = word & (word - 1u);
    int at = first + (has.x ? 0 : has.y ? 32 : has.z ? 64 : 96) + findLSB(word);
    found.w = has.x || has.y || has.z ? found.w : rest;
    found.z = has.x || has.y || !has.z ? found.z : rest;
    found.y = has.x || !has.y ? found.y : rest;
    found.x = has.x ? rest : 0u;
    uint number = texelFetch(list, at).r & (1u << DISC_BITS) - 1u;
    begin_columns(number);
    return number;
}

uint row_of_begun(usamplerBuffer list, int points_at, uint number) { return row_of(list, points_at + int(number)); }

// This invocation's pixels need none of a list.
void pass_over(inout ivec2 part) { part = ivec2(0); }
#else
// A tile's invocations bring a run into shared memory, a disc each, and tell for each column and each line of pixels which of
// the discs' boxes hold it. All have to take part: one whose pixels need nothing is `idle`.
#include "common/meet.glsl"
#include "surfels/tiles/reach.glsl"
layout(binding = TEXTURE_REACH) uniform usamplerBuffer reach;

const int RUN = 64;

struct Listed { vec4 center, form; uint number, row; };
shared Listed run[RUN];
shared uint discs_of_column[2 * COLUMNS], discs_of_line[2 * LINES];  // bits
bool idle = false;
uint begun;  // of the run

uvec4 reaching(usamplerBuffer list, int first, int last, int points_at) {
    int me = int(gl_LocalInvocationID.x), x = me % COLUMNS, y = me / COLUMNS, at = first + me;
    meet();  // the run before is over
    if (me < 2 * COLUMNS) discs_of_column[me] = 0u;
    if (me < 2 * LINES) discs_of_line[me] = 0u;
    meet();
    if (at < last) {
        uint number = texelFetch(list, at).r, word = uint(me) >> 5, bit = 1u << (me & 31);
        int point_at = points_at + int(number);
        run[me] = Listed(
            texelFetch(centers, int(number)), texelFetch(forms, int(number)), number, row_of(list, point_at)
        );
        uvec2 box = texelFetch(reach, int(texelFetch(list, point_at).r)).xy;
        ivec4 pixels = clamp(unpacked_parts(box) - (pixel - ivec2(x, y)).xyxy, ivec4(0), TILE.xyxy);
        for (int k = pixels.x; k < pixels.z; ++k) atomicOr(discs_of_column[2 * k + word], bit);
        for (int k = pixels.y; k < pixels.w; ++k) atomicOr(discs_of_line[2 * k + word], bit);
    }
    meet();
    uvec2 column = uvec2(discs_of_column[2 * x], discs_of_column[2 * x + 1]);
    uvec2 line = uvec2(discs_of_line[2 * y], discs_of_line[2 * y + 1]);
    return uvec4(idle ? uvec2(0u) : column & line, 0u, 0u);
}

uint begin_next(usamplerBuffer list, int first, inout uvec4 found) {
    bool is_low = found.x != 0u;
    uint word = is_low ? found.x : found.y, rest = word & (word - 1u);
    begun = word == 0u ? 0u : uint((is_low ? 0 : 32) + findLSB(word));
    found.xy = is_low ? uvec2(rest, found.y) : uvec2(0u, rest);
    begin_columns(run[begun].center, run[begun].form);
    return run[begun].number;
}

uint row_of_begun(usamplerBuffer list, int points_at, uint number) { return run[begun].row; }

void pass_over(inout ivec2 part) { idle = true; }
#endif

ivec2 off(int k) { return ivec2(k % PART_WIDTH, k / PART_WIDTH); }

// From the disc's centre down to a pixel.
float down_at(int k) {
    precise float y = (float(pixel.y) + (0.5 + float(off(k).y))) - disc.center_y;
    return y;
}

float key_at(int k, float y) {
    precise float key = column_key[off(k).x] + disc.key_step * y;
    return key;
}

float form_at(int k, float y) {
    precise float form = column_form[off(k).x] + y * (column_skew[off(k).x] + disc.curve * y);
    return form;
}

// What a form is at the border.
float edge_of(float key) {
    precise float edge = view_perspective ? key * key : 1.0;
    return edge;
}

bool is_inside(float form, float key) { return form <= edge_of(key); }

// No `continue` in a loop over pixels: Mesa would not unroll it, arrays would go to memory, and each loop be slower.
void take_nearest(usamplerBuffer list, ivec2 part, int points_at) {
    int first = part.x;
    do {
        uvec4 found = reaching(list, first, part.y, points_at);
        do {
            bool is_there = found != uvec4(0u);
            uint number = begin_next(list, first, found), row = row_of_begun(list, points_at, number);
            for (int k = 0; k < PIXELS; ++k) {
                float y = down_at(k), here = key_at(k, y);
                bool better = is_inside(form_at(k, y), here) && (here > best[k] || (here == best[k] && row < shown[k]));
                best[k] = better && is_there ? here : best[k];
                shown[k] = better && is_there ? row : shown[k];
#ifdef KEEPS_DISCS
                shown_discs[k] = better && is_there ? number : shown_discs[k];
#endif
            }
        } while (found != uvec4(0u));
        first += RUN;
    } while (first < part.y);
}

bool in_picture(int k) { return all(lessThan(pixel + off(k), view_size)); }

int index_of(int k) { return (pixel.y + off(k).y) * view_size.x + pixel.x + off(k).x; }

#if FILL && LARGE
// The row that the rasteriser filled a pixel with, or NOTHING, and its depth.
uint filled_row(ivec2 at, out float depth);
#endif

// FOUND: the Surface holds something already. FILL: only where it does not, this is to change; LARGE: the
// rasteriser filled some of that. Without branches, in each of which Mesa would read the view anew.
void begin_pixels() {
    float farthest_key = view_perspective ? view_near / view_far : 0.0;
    for (int k = 0; k < PIXELS; ++k) {
        best[k] = farthest_key;
        shown[k] = NOTHING;
#ifdef KEEPS_DISCS
        shown_discs[k] = NOTHING;
#endif
#if FILL
        best[k] = in_picture(k) ? farthest_key : CLOSED;
#endif
#if FOUND
        shown[k] = in_picture(k) ? rows[index_of(k)] : NOTHING;
        bool is_found = shown[k] != NOTHING;
#if FILL
        best[k] = is_found ? CLOSED : best[k];
#else
        float found = stored_depth(is_found ? uintBitsToFloat(depths[index_of(k)]) : view_near);
        best[k] = is_found ? found : best[k];
#endif
#endif
#if FILL && LARGE
        float filled_depth;
        uint filled = filled_row(pixel + off(k), filled_depth);
        if (best[k] != CLOSED && filled != NOTHING) {
            shown[k] = filled;
            best[k] = stored_depth(filled_depth);
        }
#endif
    }
}

// Of the depth that is shown; +inf where nothing is.
uint depth_bits(int k) {
    float depth = linear_depth(best[k]);
    return shown[k] == NOTHING ? NO_DEPTH : floatBitsToUint(depth);
}

void store_pixel(int k) {
#if FOUND
    if (rows[index_of(k)] == shown[k]) return;  // a depth that was read may have lost its last bits on the way
#endif
    depths[index_of(k)] = depth_bits(k);
    rows[index_of(k)] = shown[k];
}
