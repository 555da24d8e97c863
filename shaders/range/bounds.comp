// Bounds of the tiles of a level of a range view: shaders/range/tiles.glsl says what stands there. Each has the
// samples of the next row and column as well, so that what is drawn between samples is within.
#include "common/item.glsl"
#include "range/samples.glsl"

layout(std430, binding = STORAGE_RANGE_TILES) writeonly buffer Tiles { vec4 out_tiles[]; };

uniform int number;  // of the view
uniform int level;
uniform uint first;  // tile of the level that is made by this call

const float ROUNDING = 1e-6;  // of numbers in float32, and some
const float CONE_ROUNDING = 1e-4;

// The cosine between an axis and the normal of a quad's triangle that lacks a corner; 1 where that is no surface.
float triangle_cosine(RangeView view, vec4 quad[4], int lacks, vec3 axis) {
    vec4 x = quad[lacks == 0 ? 1 : 0], y = quad[lacks < 2 ? 2 : 1], z = quad[lacks == 3 ? 2 : 3];
    if (!same_surface(view, level, x.w, y.w) || !same_surface(view, level, x.w, z.w)) return 1.0;
    vec3 normal = (lacks < 2 ? 1.0 : -1.0) * cross(y.xyz - x.xyz, z.xyz - x.xyz);
    float size = length(normal);
    return size > 0.0 ? dot(axis, normal) / size : 1.0;
}

void main() {
    uint i = first + item();
    if (item() >= item_count) return;
    RangeView view = range_view(number);
    RangeLevel found = range_level(view, level);
    int columns = (found.size.x + RANGE_TILE - 1) / RANGE_TILE;
    ivec2 begin = RANGE_TILE * ivec2(int(i) % columns, int(i) / columns);
    ivec2 own = min(begin + RANGE_TILE, found.size), end = min(own + 1, found.size);
    float none = uintBitsToFloat(NO_DEPTH);
    vec3 low = vec3(none), high = vec3(-none), axis = vec3(0.0);
    vec2 spacing = vec2(none, 0.0);
    for (int y = begin.y; y < end.y; ++y) {
        vec4 here = placed_sample(view, found, level, ivec2(begin.x, y)), right, below;
        for (int x = begin.x; x < end.x; ++x, here = right) {
            right = placed_sample(view, found, level, ivec2(x + 1, y));
            if (isinf(here.w)) continue;
            vec3 bound = vec3(here.xy, -here.z);
            if (view.kind != RANGE_HEIGHT) bound.xy /= bound.z;
            low = min(low, bound);
            high = max(high, bound);
            below = placed_sample(view, found, level, ivec2(x, y + 1));
            bool goes_right = same_surface(view, level, here.w, right.w);
            bool goes_down = same_surface(view, level, here.w, below.w);
            vec2 apart = vec2(distance(here.xyz, right.xyz), distance(here.xyz, below.xyz));
            if (goes_right) spacing = vec2(min(spacing.x, apart.x), max(spacing.y, apart.x));
            if (goes_down) spacing = vec2(min(spacing.x, apart.y), max(spacing.y, apart.y));
            if (goes_right && goes_down) axis += cross(below.xyz - here.xyz, right.xyz - here.xyz) / (apart.x * apart.y);
        }
    }
    bool any_sample = low.z <= high.z;
    float cosine = -1.0;
    if (any_sample && axis != vec3(0.0)) {
        vec3 middle = view.kind == RANGE_HEIGHT ? vec3(0.0, 0.0, -1.0) : vec3(low.xy + high.xy, -2.0);
        axis = normalize(axis) * (dot(axis, middle) > 0.0 ? -1.0 : 1.0);
        cosine = 1.0;
        for (int y = begin.y; y < own.y; ++y) {
            vec4 around[9];
            for (int i = 0; i < 9; ++i)  // the columns before the first, which move on
                around[i] = placed_sample(view, found, level, ivec2(begin.x - 2 + i % 3, y + i / 3 - 1));
            for (int x = begin.x; x < own.x; ++x) {
                for (int i = 0; i < 9; i += 3) {
                    around[i] = around[i + 1];
                    around[i + 1] = around[i + 2];
                    around[i + 2] = placed_sample(view, found, level, ivec2(x + 1, y + i / 3 - 1));
                }
                if (isinf(around[4].w)) continue;
                cosine = min(cosine, dot(axis, fitted_normal(view, level, around)));  // 0 where unknown
                vec4 quad[4] = vec4[](around[4], around[5], around[7], around[8]);
                for (int i = 0; i < 4; ++i) cosine = min(cosine, triangle_cosine(view, quad, i, axis));
            }
        }
        cosine = max(cosine - CONE_ROUNDING, -1.0);
    }
    if (spacing.y == 0.0) spacing = vec2(sample_spacing(view, level, low.z), sample_spacing(view, level, high.z));
    if (any_sample) {
        low -= ROUNDING * abs(low);
        high += ROUNDING * abs(high);
    }
    uint at = uint(RANGE_TILE_TEXELS) * (uint(found.first_tile) + i);
    out_tiles[at] = vec4(low, spacing.x);
    out_tiles[at + 1u] = vec4(high, spacing.y);
    out_tiles[at + 2u] = vec4(axis, cosine);
}
