// The engine of code words (Maršík 2010, 2.4): a work group draws a part of a strip in a band of lines, held in shared
// memory, and flushes it. Of the words that cover a pixel the least depth is seen, of these the least rank: whole numbers,
// and least ones, whichever order words come in. FINER: depths are those beside the words, in place of Z. PACKED: Z and
// rank fit into one number. OWNERS: a rank is a number of OWNERS; else it is the row itself. SHOWN 0: keys and ranks;
// 1: depths and rows of a Surface. SHIFT: how many last bits of finer depths the depth buffer leaves out. NOWHERE:
// depth where nothing is. LIT: with colours. A band of very many words is drawn in several calls, since drivers may bound
// how often a loop turns: `skipped` is how many words of each band were drawn before, RESUMED: there were some, of which
// keys and ranks tell.
#include "common/item.glsl"
// backends/codeword/engine.py.
#include <params>

layout(binding = TEXTURE_SPLATS) uniform usamplerBuffer words;  // lower and upper half
layout(binding = TEXTURE_STARTS) uniform usamplerBuffer starts;  // of lines
layout(binding = TEXTURE_IDS) uniform usamplerBuffer ranks;  // of words
#if FINER
layout(binding = TEXTURE_FORMS) uniform isamplerBuffer finer;
#endif
#if OWNERS
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer owners;  // rows, of ranks
#endif
#if LIT
layout(binding = TEXTURE_LOOKS) uniform usamplerBuffer heads;  // of ranks: diffuse, specular, material
layout(binding = TEXTURE_COLORS) uniform usamplerBuffer materials;  // I_0, k_d, k_s of each
layout(binding = TEXTURE_ENCODED) uniform usamplerBuffer encoded;  // sRGB of light
layout(std430, binding = STORAGE_COLOR) writeonly buffer Color { uint own[]; };
#endif
layout(std430, binding = STORAGE_DEPTHS) buffer Depths { uint depths[]; };
layout(std430, binding = STORAGE_ROWS) buffer Rows { uint rows[]; };
uniform uint skipped;

const int LINES = 8;  // of a bitmap
const int ROWS = 4;   // in SCANS
const int ROW_BITS = 6;
const int PASSES = PACKED != 0 ? 1 : 2;  // keys; ranks
const uint SIGN = 1u << 31;

shared uint best[PIXELS];  // rank; PACKED: below Z
#if !PACKED
shared uint keys[PIXELS];  // depths, in the order of unsigned numbers
#endif

void meet() {
    memoryBarrierShared();
    barrier();
}

uint start_of(int line) { return texelFetch(starts, line).r; }

#if FINER
// A finer depth as the depth buffer holds it.
int kept(int depth) { return SHIFT == 0 ? depth : clamp(depth, 0, MOST_DEPTH) >> SHIFT; }
#endif

void take(int at, uint key, uint rank, int pass) {
#if PACKED
    atomicMin(best[at], key << RANK_BITS | rank);
#else
    if (pass == 0) atomicMin(keys[at], key);
    else if (keys[at] == key) atomicMin(best[at], rank);
#endif
}

// The pixels of a row of a word that lie in the part. word: its lower and upper half, its number. line: its own.
void draw_row(uvec3 word, ivec2 span, int line, int row, ivec4 part, uint rank, int pass) {
    int y = line + row, x = int(word.y >> 14 & 511u);
    if (y < part.y || y >= part.w) return;
    uint key = word.y >> 23;
#if FINER
    ivec3 plane = texelFetch(finer, int(word.z)).xyz;
    int depth = plane.x + row * plane.z - x * plane.y;
#endif
    int at = (y - part.y) * columns - part.x;
    for (int column = max(x + span.x, part.x); column <= min(x + span.y, part.z - 1); ++column) {
#if FINER
        key = uint(kept(depth + column * plane.y)) ^ SIGN;
#endif
        take(at + column, key, rank, pass);
    }
}

// The words of the lines of a part, and of those above that reach into it: an invocation has a row of SCANS, and the one
// that is the same turned by half. before: of all lines, the first of the strip. part: left, top, right, bottom.
void sweep(int before, ivec4 part, int pass) {
    int line = max(part.y - LINES + 1, 0);
    uint from = start_of(before + line) + skipped, after = start_of(before + part.w);
    uint end = uint(ROWS) * min(after - min(from, after), MOST_WORDS);
    uint next = start_of(before + line + 1);
    for (uint k = gl_LocalInvocationID.x; k < end; k += uint(GROUP)) {
        uint number = from + k / uint(ROWS);
        int row = int(k % uint(ROWS));
        while (number >= next) next = start_of(before + ++line + 1);
        uvec3 word = uvec3(texelFetch(words, int(number)).xy, number);
        uint field = word.x >> 1 + ROW_BITS * row, rank = texelFetch(ranks, int(number)).r;
        ivec2 span = ivec2(field & 7u, field >> 3 & 7u);
        draw_row(word, span, line, row, part, rank, pass);
        if ((word.x & 1u) == 0u) draw_row(word, LINES - 1 - span.yx, line, LINES - 1 - row, part, rank, pass);
    }
}

#if LIT
// viewer/codewords/lighting.py.
uint color_of(uint rank) {
    uint head = texelFetch(heads, int(rank)).r;
    uvec2 index = uvec2(head, head >> 7) & 127u, parts = index + (index >> 6);
    int material = 3 * int(head >> 14);
    uvec3 light = texelFetch(materials, material + 1).xyz * parts.x + texelFetch(materials, material + 2).xyz * parts.y;
    light = min(texelFetch(materials, material).xyz + (light + 64u >> 7), uint(LIGHT_STEPS));
    uint color = 255u << 24;
    for (int k = 0; k < 3; ++k) color |= texelFetch(encoded, int(light[k])).r << 8 * k;
    return color;
}
#endif

uint depth_of(uint key) {
#if SHOWN
#if FINER
    float number = float(int(key ^ SIGN));
#else
    float number = float(key);
#endif
    float depth = nearest + number * depth_step;
    return floatBitsToUint(is_inverse ? 1.0 / max(depth, least_inverse) : depth);
#else
    return FINER != 0 ? key ^ SIGN : key;
#endif
}

#if RESUMED
// What was flushed of keys and ranks: ranks once keys are known, as those of another key are none.
void resume(int pixel, int at, int pass) {
    uint rank = rows[pixel], key = FINER != 0 || rank == NOTHING ? depths[pixel] ^ SIGN : depths[pixel];
#if PACKED
    best[at] = rank == NOTHING ? NOTHING : key << RANK_BITS | rank;
#else
    if (pass == 0) keys[at] = key;
    else if (keys[at] == key) best[at] = rank;
#endif
}
#endif

void flush(int pixel, int at) {
    uint rank = best[at];
    bool is_seen = rank != NOTHING;
#if PACKED
    uint key = rank >> RANK_BITS;
    rank &= (1u << RANK_BITS) - 1u;
#else
    uint key = keys[at];
#endif
    depths[pixel] = is_seen ? depth_of(key) : NOWHERE;
#if OWNERS
    rows[pixel] = is_seen ? texelFetch(owners, int(rank)).r : NOTHING;
#else
    rows[pixel] = is_seen ? rank : NOTHING;
#endif
#if LIT
    if (is_seen) own[pixel] = color_of(rank);
#endif
}

void main() {
    int group = int(item() / uint(GROUP)), me = int(gl_LocalInvocationID.x);
    int part = group % parts, band = group / parts;  // of all strips, `parts` in each line
    int strip = part / strip_parts, left = (part - strip * strip_parts) * columns;
    int origin = strip * stride, right = min(min(left + columns, stride), picture_size.x - origin);
    int top = band * lines, bottom = min(top + lines, picture_size.y);
    for (int at = me; at < columns * lines; at += GROUP) {
        best[at] = NOTHING;
#if !PACKED
        keys[at] = NOTHING;
#endif
    }
    for (int pass = 0; pass < PASSES; ++pass) {
        meet();
#if RESUMED
        for (int y = top; y < bottom; ++y)
            for (int column = left + me; column < right; column += GROUP)
                resume(y * picture_size.x + origin + column, (y - top) * columns + column - left, pass);
        meet();
#endif
        if (left < right && top < bottom) sweep(strip * picture_size.y, ivec4(left, top, right, bottom), pass);
    }
    meet();
    for (int y = top; y < bottom; ++y)
        for (int column = left + me; column < right; column += GROUP)
            flush(y * picture_size.x + origin + column, (y - top) * columns + column - left);
}
