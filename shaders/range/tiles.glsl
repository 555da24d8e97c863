// Tiles of range views, RANGE_TILE x RANGE_TILE samples of a level each (bounds.comp makes them), and which of
// them a picture needs: whatever is told to be outside or facing away is so for each of its samples, and for
// what lies between these and their neighbours to the right and below.
#include "common/view.glsl"
#include "range/samples.glsl"

layout(binding = TEXTURE_RANGE_TILES) uniform samplerBuffer range_tiles;

const float TILE_ROUNDING = 2e-6;  // of places in float32, and some

// low, high: bounds of the samples in pod space: right and up per unit of depth (for heights in scan units), and
// depth along the axis. spacing: between neighbours of one surface, the least and the largest; where none has one,
// across the line of sight. axis, cosine: all normals are within this cone; -1: unknown.
struct RangeTile {
    vec3 low, high;
    vec2 spacing;
    vec3 axis;
    float cosine;
};

int tile_index(RangeLevel level, ivec2 uv) {
    return level.first_tile + uv.y / RANGE_TILE * ((level.size.x + RANGE_TILE - 1) / RANGE_TILE) + uv.x / RANGE_TILE;
}

// The view and the level of a tile, or of what is left free behind one's tiles.
ivec2 level_of_tile(int index, int view_count) {
    int low = 0, high = view_count * RANGE_MOST_LEVELS - 1;
    while (low < high) {
        int middle = (low + high + 1) / 2;
        int entry = middle / RANGE_MOST_LEVELS * RANGE_ENTRY + RANGE_LEVELS_AT + middle % RANGE_MOST_LEVELS;
        bool after = int(texelFetch(range_views, entry).y) > index;
        low = after ? low : middle;
        high = after ? middle - 1 : high;
    }
    return ivec2(low / RANGE_MOST_LEVELS, low % RANGE_MOST_LEVELS);
}

RangeTile range_tile(int index) {
    vec4 low = texelFetch(range_tiles, RANGE_TILE_TEXELS * index);
    vec4 high = texelFetch(range_tiles, RANGE_TILE_TEXELS * index + 1);
    vec4 cone = texelFetch(range_tiles, RANGE_TILE_TEXELS * index + 2);
    return RangeTile(low.xyz, high.xyz, vec2(low.w, high.w), cone.xyz, cone.w);
}

bool is_empty(RangeTile tile) { return tile.low.z > tile.high.z; }

// One of the eight corners, in pod space.
vec3 tile_corner(RangeView v, RangeTile tile, int number) {
    vec3 corner = mix(tile.low, tile.high, notEqual(number & ivec3(1, 2, 4), ivec3(0)));
    return vec3(v.kind == RANGE_HEIGHT ? corner.xy : corner.xy * corner.z, -corner.z);
}

// Whether no pixel can show it: all corners are beyond one of the picture's planes by more than so many pixels.
bool is_outside(RangeView v, RangeTile tile, float margin) {
    vec2 reach = max(view_center, vec2(view_size) - view_center) + margin;
    vec3 least = vec3(uintBitsToFloat(NO_DEPTH)), most = -least;  // beyond left and top, right and bottom, near and far
    for (int i = 0; i < 8; ++i) {
        vec3 pod = tile_corner(v, tile, i), place = to_screen_view(v, pod);
        float depth = -place.z;
        vec3 moved = abs(vec3(v.screen[0].w, v.screen[1].w, v.screen[2].w));
        float slack = TILE_ROUNDING * (dot(abs(pod), vec3(1.0)) + dot(moved, vec3(1.0)));
        vec2 edge = reach * (view_perspective ? depth : 1.0), slack_edge = slack * (view_scale + (view_perspective ? reach : vec2(0.0)));
        vec2 offset = vec2(place.x, -place.y) * view_scale;
        least = min(least, vec3(offset - edge - slack_edge, depth - slack));
        most = max(most, vec3(offset + edge + slack_edge, depth + slack));
    }
    return any(greaterThan(least.xy, vec2(0.0))) || any(lessThan(most.xy, vec2(0.0))) || most.z < view_near
        || least.z > view_far;
}

// Whether all its samples have a normal that points away from the eye.
bool faces_away(RangeView v, RangeTile tile) {
    if (!(tile.cosine > 0.0)) return false;
    float sine = sqrt(1.0 - tile.cosine * tile.cosine);
    vec3 eye = vec3(v.pod[0].w, v.pod[1].w, v.pod[2].w);
    vec3 forwards = -vec3(v.pod[0].z, v.pod[1].z, v.pod[2].z);
    bool away = true;
    for (int i = 0; i < 8; ++i) {
        vec3 sight = view_perspective ? tile_corner(v, tile, i) - eye : forwards;
        away = away && dot(sight, tile.axis) > sine * length(sight);
    }
    return away;
}

// Pixels between neighbouring samples: the least, where these lie across the line of sight, and the most that there
// can be in the picture.
vec2 footprint(RangeView v, RangeTile tile) {
    float nearest = uintBitsToFloat(NO_DEPTH), farthest = 0.0;
    for (int i = 0; i < 8; ++i) {
        float depth = -to_screen_view(v, tile_corner(v, tile, i)).z;
        nearest = min(nearest, depth);
        farthest = max(farthest, depth);
    }
    if (!view_perspective) return tile.spacing * view_scale;
    float aside = length(max(view_center, vec2(view_size) - view_center)) / view_scale;  // in the picture's corners, along the line of sight
    return tile.spacing * vec2(scale_at(farthest), scale_at(max(nearest, view_near)) * sqrt(1.0 + aside * aside));
}
