// Larger splats close gaps, but also reach over the outline by as much as they are larger. So what they
// filled is taken back where nothing is shown at that distance: dilated, then eroded.
// Filled pixels are listed and have a negative depth, and a row until the last step. STEP 0 says which are taken back,
// reading depths alone, which change in STEP 1, so that the order does not matter; STEP 2: filled from level 1, by no
// point.
#include "surfels/passes/limit.glsl"
#include "amplify/texels.glsl"
#include "surfels/disc.glsl"
#include "common/item.glsl"
#include "common/list.glsl"

layout(std430, binding = STORAGE_DEPTHS) buffer Depths { uint depths[]; };
layout(std430, binding = STORAGE_ROWS) buffer Rows { uint rows[]; };

#if STEP == 2
layout(std430, binding = STORAGE_LEVEL) writeonly buffer Level { uint own_levels[]; };
#endif

const int DIRECTIONS = 16;
const float SLACK = 0.75;  // pixels that the outline may grow by

bool is_empty(ivec2 pixel) {
    if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, view_size))) return false;
    return depths[pixel.y * view_size.x + pixel.x] == NO_DEPTH;
}

vec3 form;  // of the pixel's splat, 1 at its border (surfels/disc.glsl)

void begin_splat(float depth, uint row) {
    begin_disc(texel_point(int(row)));
    vec3 key = disc_key(form);
    if (view_perspective) form /= key.x * key.x;
}

// How much larger the pixel's splat became in a direction, pixels.
float growth(vec2 to, float depth) {
    return (enlarge - 1.0) * inversesqrt(form.x * to.x * to.x + to.y * (2.0 * form.y * to.x + form.z * to.y));
}

// Whether nothing is shown so far away in some direction.
bool near_outline(vec2 center, float depth) {
    for (int i = 0; i < DIRECTIONS; ++i) {
        float angle = 6.2831853 / DIRECTIONS * i;
        vec2 to = vec2(cos(angle), sin(angle));
        float reach = growth(to, depth) - SLACK;
        if (reach > 0.0 && is_empty(ivec2(floor(center + reach * to)))) return true;
    }
    return false;
}

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint index = list[i];
#if STEP == 0
    float depth = -uintBitsToFloat(depths[index]);
    begin_splat(depth, rows[index]);
    vec2 center = vec2(index % view_size.x, index / view_size.x) + 0.5;
    if (near_outline(center, depth)) rows[index] = NOTHING;
#elif STEP == 1
    depths[index] = rows[index] == NOTHING ? NO_DEPTH : depths[index] & 0x7FFFFFFFu;
#else
    rows[index] = NOTHING;
    own_levels[index] = 1u;
#endif
}
