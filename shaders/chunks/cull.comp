// Which chunks of points the picture may show (viewer/splatting/culling.py). A chunk is hidden where all that it can cover has
// nearer depths already, from the points that were drawn before: what is seen is 0 of chunks that no picture showed.
// STEP 0: finds those in view that are drawn first. 1: finds out of all whether this picture may show them, and those that
// it may and that were not drawn first. 2: finds all that this one may show. 3: finds all in view, and nothing else.
// LISTS: these are listed.
// First come those that the last picture showed; SPLATS, which are drawn anew where that was not all: those that it did not
// find to be hidden, not even where they moved a little.
#include "common/item.glsl"
#include "common/view.glsl"
#if LISTS
#include "common/list.glsl"
#endif

layout(binding = TEXTURE_BOXES) uniform samplerBuffer boxes;  // lower corner, upper corner
layout(std430, binding = STORAGE_SEEN) buffer Seen { uint seen[]; };  // bits below
#if STEP == 1
layout(binding = TEXTURE_FARTHEST_TILES) uniform usamplerBuffer farthest;  // of each tile, float bits
#endif
#if SPLATS
layout(binding = TEXTURE_CONES) uniform samplerBuffer cones;  // as chunks/bounds.comp has them
layout(binding = TEXTURE_REACHES) uniform samplerBuffer reaches;
#endif
#include <params>

const uint LAST = 1u, NOW = 2u, IN_VIEW = 4u, FACES_AWAY = 8u, HIDDEN = 16u;

// The pixels that a chunk may cover, their first and their last, as far as they are in the picture.
struct Reach {
    bool in_view;
    ivec2 first, last;
    float nearest;
};

#if SPLATS
// Of the radius of a splat, pixels, half of that from which on tiles leave it to the rasteriser. How many do so decides how all
// are drawn, so that chunks which may have such are never hidden.
const float LARGE = 60.0;
#endif

#if SPLATS
// How far a splat of the chunk reaches from its point at most, scan units, as surfels/splat.glsl has it.
float splat_reach(uint chunk, vec3 low, vec3 high) {
    vec3 halves = 0.5 * (high - low), along = vec3(world_to_view[0].z, world_to_view[1].z, world_to_view[2].z);
    float far = -to_view(0.5 * (low + high)).z + dot(abs(along), halves);
    float radius = radius_scale * max(texelFetch(reaches, int(chunk)).r, uniform_radius);
    return 1.001 * max(radius, least_radius / scale_at(max(far, view_near)));
}

// Whether all splats of a chunk show the eye their backs: of a sphere round the points, and a cone round the normals.
bool faces_away(vec3 low, vec3 high, vec4 cone) {
    vec3 center = to_view(0.5 * (low + high)), to_eye = view_perspective ? -center : vec3(0.0, 0.0, 1.0);
    float far = length(to_eye), radius = view_perspective ? 0.5 * length(high - low) : 0.0;
    float facing = dot(mat3(world_to_view) * cone.xyz, to_eye), across = sqrt(max(far * far - facing * facing, 0.0));
    float sine = sqrt(max(1.0 - cone.w * cone.w, 0.0));
    // The cone does not hold the direction to the eye, and its side that is nearest to that is turned away.
    bool is_beside = cone.w > 0.0 && facing < cone.w * far - 1e-4 * far;
    return is_beside && facing * cone.w + across * sine < -radius - 1e-4 * far;
}
#endif

Reach reach_of(uint chunk, vec3 low, vec3 high) {
#if SPLATS
    float slack = box_slack + splat_reach(chunk, low, high);
#else
    float slack = box_slack;
#endif
    low -= slack;
    high += slack;
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
#if SPLATS
    is_before = is_before && slack * scale_at(near) < LARGE;
#endif
    bool in_view = all(lessThanEqual(first, last)) && far >= view_near && near <= view_far;
    return Reach(in_view, ivec2(first), ivec2(max(last, vec2(0.0))), is_before ? near - 1e-5 * abs(near) : 0.0);
}

#if STEP == 1
// The depth in front of which splats count in a tile.
float limit_of(int tile) {
    float depth = uintBitsToFloat(texelFetch(farthest, tile).r);
#if SPLATS
    depth += max(behind, pixels_behind / scale_at(depth));
#endif
    return depth;
}

// spare: how many pixels around must hide it, too.
bool is_hidden(Reach reach, int spare) {
    ivec2 tiles = (view_size + TILE - 1) / TILE;
    ivec2 first = max(reach.first - spare, ivec2(0)) / TILE, last = min((reach.last + spare) / TILE, tiles - 1);
    int wide = last.x - first.x + 1, count = wide * (last.y - first.y + 1);
    if (count > MOST_TILES) return false;
    bool hidden = true;
    for (int i = 0; i < count && hidden; ++i) {
        int tile = (first.y + i / wide) * tiles.x + first.x + i % wide;
        hidden = limit_of(tile) < reach.nearest;
    }
    return hidden;
}
#endif

void main() {
    uint chunk = item();
    if (chunk >= item_count) return;
    uint before = seen[chunk];
#if STEP != 2
    vec3 low = texelFetch(boxes, 2 * int(chunk)).xyz, high = texelFetch(boxes, 2 * int(chunk) + 1).xyz;
    Reach reach = reach_of(chunk, low, high);
#endif
#if STEP == 0
#if SPLATS
    bool away = reach.in_view && cull_back && faces_away(low, high, texelFetch(cones, int(chunk)));
    bool hidden = reach.in_view && (before & HIDDEN) != 0u, listed = reach.in_view && !away && !(trusts && hidden);
    seen[chunk] = (away ? FACES_AWAY : 0u) | (hidden ? HIDDEN : 0u) | (listed ? LAST : 0u) | (reach.in_view ? IN_VIEW : 0u);
#else
    bool listed = reach.in_view && (before & NOW) != 0u;
    seen[chunk] = (listed ? LAST : 0u) | (reach.in_view ? IN_VIEW : 0u);
#endif
#elif STEP == 1
    bool may_show = (before & IN_VIEW) != 0u && (before & FACES_AWAY) == 0u;
    bool shown = may_show && !is_hidden(reach, 0), listed = shown && (before & LAST) == 0u;
    seen[chunk] = (before & ~HIDDEN) | (shown ? NOW : 0u);
#if SPLATS
    if (may_show && !shown && is_hidden(reach, spare_pixels)) seen[chunk] |= HIDDEN;
#endif
#elif STEP == 2
    bool listed = (before & NOW) != 0u;
#else
    bool listed = reach.in_view;
#endif
#if LISTS
    if (listed) list[reserve(uint(CHUNK)) / uint(CHUNK)] = chunk;
#endif
}
