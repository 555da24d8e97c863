// Which chunks of points the picture may show (viewer/gpu/culling.py). A chunk is hidden where all that it can cover has
// nearer depths already, from the points that were drawn before: what is seen is 0 of chunks that no picture showed.
// STEP 0: lists those in view that the last picture showed. 1: finds out of all whether this one may show them, and lists
// those that it may and the last one did not. 2: lists all that this one may show.
#include "common/item.glsl"
#include "common/list.glsl"
#include "common/view.glsl"

layout(binding = TEXTURE_BOXES) uniform samplerBuffer boxes;  // lower corner, upper corner
layout(std430, binding = STORAGE_SEEN) buffer Seen { uint seen[]; };  // bits below
#if STEP == 1
layout(binding = TEXTURE_FARTHEST_TILES) uniform usamplerBuffer farthest;  // of each tile, float bits
#endif
#include <params>

const uint LAST = 1u, NOW = 2u, IN_VIEW = 4u;

// The pixels that a chunk may cover, their first and their last, as far as they are in the picture.
struct Reach {
    bool in_view;
    ivec2 first, last;
    float nearest;
};

Reach reach_of(uint chunk) {
    vec3 low = texelFetch(boxes, 2 * int(chunk)).xyz - box_slack;
    vec3 high = texelFetch(boxes, 2 * int(chunk) + 1).xyz + box_slack;
    float near = uintBitsToFloat(NO_DEPTH), far = -near;
    vec2 first = vec2(near), last = vec2(far);
    for (int i = 0; i < 8; ++i) {
        vec3 view = to_view(mix(low, high, bvec3(i & 1, i & 2, i & 4)));
        near = min(near, -view.z);
        far = max(far, -view.z);
        vec2 pixel = to_pixel(view);
        first = min(first, pixel);
        last = max(last, pixel);
    }
    // What reaches to the eye's plane and behind may be anywhere in the picture.
    bool is_before = !view_perspective || near > max(view_near, 1e-6 * far);
    if (!is_before) first = vec2(0.0), last = vec2(view_size);
    first = max(first - pixel_margin, vec2(0.0));
    last = min(last + pixel_margin, vec2(view_size) - 1.0);
    bool in_view = all(lessThanEqual(first, last)) && far >= view_near && near <= view_far;
    return Reach(in_view, ivec2(first), ivec2(max(last, vec2(0.0))), is_before ? near - 1e-5 * abs(near) : 0.0);
}

#if STEP == 1
bool is_hidden(Reach reach) {
    ivec2 first = reach.first / TILE, last = reach.last / TILE;
    int across = (view_size.x + TILE - 1) / TILE, wide = last.x - first.x + 1, count = wide * (last.y - first.y + 1);
    if (count > MOST_TILES) return false;
    bool hidden = true;
    for (int i = 0; i < count && hidden; ++i) {
        int tile = (first.y + i / wide) * across + first.x + i % wide;
        hidden = uintBitsToFloat(texelFetch(farthest, tile).r) < reach.nearest;
    }
    return hidden;
}
#endif

void main() {
    uint chunk = item();
    if (chunk >= item_count) return;
    uint before = seen[chunk];
#if STEP == 0
    bool in_view = reach_of(chunk).in_view, listed = in_view && (before & NOW) != 0u;
    seen[chunk] = (listed ? LAST : 0u) | (in_view ? IN_VIEW : 0u);
#elif STEP == 1
    bool shown = (before & IN_VIEW) != 0u && !is_hidden(reach_of(chunk)), listed = shown && (before & LAST) == 0u;
    if (shown) seen[chunk] = before | NOW;
#else
    bool listed = (before & NOW) != 0u;
#endif
    if (listed) list[reserve(uint(CHUNK)) / uint(CHUNK)] = chunk;
}
