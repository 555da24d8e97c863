// What shaders find for each item of a level: its place, normal and where it projects to, and for a tile whether
// it is needed.
#include "common/item.glsl"
#include "range/tiles.glsl"

layout(std430, binding = 0) writeonly buffer Found { vec4 found[]; };
uniform int number;  // of the view
uniform int level;
uniform int target;  // view that places are projected to
uniform int view_count;
uniform float margin;

void main() {
    uint i = item();
    if (i >= item_count) return;
    RangeView v = range_view(number);
    RangeLevel own = range_level(v, level);
#if PROBE_TILES
    RangeTile tile = range_tile(own.first_tile + int(i));
    found[2u * i] = vec4(is_empty(tile), is_outside(v, tile, margin), faces_away(v, tile), tile.cosine);
    found[2u * i + 1u] = vec4(footprint(v, tile), tile.spacing);
#else
    ivec2 uv = ivec2(int(i) % own.size.x, int(i) / own.size.x);
    int index = sample_index(v, level, uv);
    vec3 pod = sample_place(v, level, vec2(uv), sample_depth(index)), place = to_screen_view(v, pod);
    uint id = sample_id(v, uv);
    found[5u * i] = vec4(pod, is_sample(index));
    found[5u * i + 1u] = vec4(place, float(id));
    found[5u * i + 2u] = vec4(sample_normal(v, level, uv), level_to_pixel(v, level, vec2(uv)).x);
    found[5u * i + 3u] = vec4(project_to(range_view(target), place), pixel_to_level(v, level, level_to_pixel(v, level, vec2(uv))).y);
    ivec4 decoded = sample_at(index, view_count), of_id = level == 0 ? sample_of_id(id, view_count) : decoded;
    found[5u * i + 4u] = vec4(decoded == ivec4(number, level, uv), of_id == decoded, tile_index(own, uv) - own.first_tile, index);
#endif
}
