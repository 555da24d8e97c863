// The invocations of listed tiles: each keeps ROWS pixels, one below another, and looks at the tile's discs.
// No atomics: the best depth and the lowest row at that depth stay in registers.
#include "surfels/tiles/grid.glsl"

layout(local_size_x = TILE, local_size_y = COLUMNS, local_size_z = TILES) in;

layout(binding = TEXTURE_PLACES) uniform samplerBuffer places;  // centre, pixels; key there; its step right
layout(binding = TEXTURE_FORMS) uniform samplerBuffer forms;   // the key's step down; a, b, c (surfels/disc.glsl)
layout(binding = TEXTURE_STARTS) uniform usamplerBuffer starts;  // of each tile's part of the list
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;  // discs, in the order of the points drawn
#if AWAY
// Of those that face away, which a second filling listed.
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
// Mesa's Zink cannot read one (docs/surfels.md).
#define CLOSED uintBitsToFloat(NO_DEPTH)

float best[ROWS];  // reversed depth-buffer values
uint shown[ROWS];
ivec2 pixel;       // the first of this invocation's

// -1: none, at the end of the last work group; its pixels are outside the picture.
int this_tile() {
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint at = group * TILES + gl_LocalInvocationID.z;
    int tile = at < texelFetch(work, 3).r ? int(texelFetch(work, int(at) + 4).r) : -1;
    pixel = (tile < 0 ? tiles : ivec2(tile % tiles.x, tile / tiles.x)) * TILE;
    pixel += ivec2(gl_LocalInvocationID.x, gl_LocalInvocationID.y * ROWS);
    return tile;
}

// A tile's part of the list: first, and the one after the last.
ivec2 part_of(usamplerBuffer begins, int tile) {
    if (tile < 0) return ivec2(0);
    return ivec2(texelFetch(begins, tile).r, texelFetch(begins, tile + 1).r);
}

uint row_of(uint disc) {
#if SAMPLED
    return texelFetch(drawn_rows, int(disc)).r;
#else
    return disc;
#endif
}

struct Column { float center_y, key, key_step, form, skew, curve; };

// What a disc is along this invocation's column of pixels.
Column column_of(uint disc) {
    vec4 a = texelFetch(places, int(disc)), b = texelFetch(forms, int(disc));
    precise float x = float(pixel.x) + 0.5 - a.x;
    precise float key = a.z + a.w * x;
    precise float form = b.y * x * x;
    return Column(a.y, key, b.x, form, 2.0 * b.z * x, b.w);
}

// From the disc's centre to a pixel of the column.
float down_at(Column c, int k) {
    precise float y = (float(pixel.y) + (0.5 + float(k))) - c.center_y;
    return y;
}

// A disc's key and form at a pixel are the same numbers however pixels are shared out: `precise`.
float key_at(Column c, float y) {
    precise float key = c.key + c.key_step * y;
    return key;
}

float form_at(Column c, float y) {
    precise float form = c.form + y * (c.skew + c.curve * y);
    return form;
}

bool is_inside(float form, float key) { return form <= (PERSPECTIVE != 0 ? key * key : 1.0); }

// No `continue` in a loop over pixels: Mesa would not unroll it, arrays would go to memory, and each loop be slower.
void take_nearest(usamplerBuffer list, ivec2 part) {
    for (int i = part.x; i < part.y; ++i) {
        uint disc = texelFetch(list, i).r, row = row_of(disc);
        Column c = column_of(disc);
        for (int k = 0; k < ROWS; ++k) {
            float y = down_at(c, k), here = key_at(c, y);
            bool better = is_inside(form_at(c, y), here) && (here > best[k] || (here == best[k] && row < shown[k]));
            best[k] = better ? here : best[k];
            shown[k] = better ? row : shown[k];
        }
    }
}

bool in_picture(int k) { return pixel.x < view_size.x && pixel.y + k < view_size.y; }

int index_of(int k) { return (pixel.y + k) * view_size.x + pixel.x; }

#if FILL && LARGE
layout(binding = TEXTURE_LARGE_ROWS) uniform usampler2D large_rows;
layout(binding = TEXTURE_LARGE_DEPTHS) uniform sampler2D large_depths;  // negative, as surfels/passes/fill.frag has it
#endif

// FOUND: the Surface holds something already. FILL: only where it does not, this is to change; LARGE: the
// rasteriser filled some of that.
void begin_pixels() {
    for (int k = 0; k < ROWS; ++k) {
        best[k] = view_perspective ? view_near / view_far : 0.0;
        shown[k] = NOTHING;
#if FILL
        if (!in_picture(k)) best[k] = CLOSED;
#endif
#if FOUND
        if (in_picture(k) && rows[index_of(k)] != NOTHING) {
            shown[k] = rows[index_of(k)];
            best[k] = FILL != 0 ? CLOSED : stored_depth(uintBitsToFloat(depths[index_of(k)]));
        }
#endif
#if FILL && LARGE
        ivec2 at = pixel + ivec2(0, k);
        if (best[k] != CLOSED && texelFetch(large_rows, at, 0).r != NOTHING) {
            shown[k] = texelFetch(large_rows, at, 0).r;
            best[k] = stored_depth(-texelFetch(large_depths, at, 0).r);
        }
#endif
    }
}

// Of the depth that is shown; +inf where nothing is.
uint depth_bits(int k) {
    return shown[k] == NOTHING ? NO_DEPTH : floatBitsToUint(linear_depth(best[k]));
}

void store_pixel(int k) {
    depths[index_of(k)] = depth_bits(k);
    rows[index_of(k)] = shown[k];
}
