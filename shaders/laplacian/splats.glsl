// Levels of a capture in the picture (Farooq 2013, 6.2.3): each sample of each level of a view is a Gaussian over 3 x 3 cells
// of the level of the picture whose cells are as large, placed to a part of a cell. Levels of the picture lie one after
// another; cell i of a level is in the middle of pixel i * 2^level, as samples of the view's levels are on finer ones.
// Samples that are not of the nearest surface, by depth or as they face the other way, are left out: by the sample of the finest
// level that a coarse one lies on, since means over a wide reach are not on the surface.
#include "common/color.glsl"
#include <params>
#include "pyramidal/views/grid.glsl"
#include "laplacian/pictures.glsl"
#include "laplacian/fitting.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer front;  // of the nearest surface
layout(binding = TEXTURE_OWN_NORMALS) uniform samplerBuffer front_normals;

uniform int number;    // of the view
uniform int first;     // of its samples
uniform int count;     // of the levels of the picture
uniform int farthest;  // level of the view that the finest one of the picture may show

bool is_front(int pixel, float depth, float reach) {
    float nearest = uintBitsToFloat(texelFetch(front, pixel).r);
    return !isinf(nearest) && abs(depth - nearest) <= reach + tolerance / scale_at(nearest);
}

void scatter(uint i) {
    ivec4 at = sample_at(first + int(i), RANGE_COUNT);
    RangeView v = range_view(number);
    RangeLevel found = range_level(v, at.y);
    if (at.x != number || at.w >= found.size.y) return;  // what is left free between levels
    Corner corner = corner_at(v, found, at.y, at.zw);
    if (!corner.there) return;
    // The nearest level: Gaussians over three cells leave no gaps where samples are up to one and a half apart.
    int fits = min(int(floor(level_that_fits(v, corner.place, -corner.place.z) + 0.5)), farthest), level = at.y - fits;
    if (level < 0 || level >= count) return;

    Corner seen = corner_at(v, range_level(v, 0), 0, min(at.zw << at.y, v.size - 1));
    if (!seen.there) seen = corner;
    if (any(lessThan(seen.pixel, vec2(0.0))) || any(greaterThanEqual(seen.pixel, vec2(view_size)))) return;
    int under = int(seen.pixel.y) * view_size.x + int(seen.pixel.x);
    float reach = tolerance * sample_spacing(v, max(fits, 0), seen.depth);
    if (!is_front(under, -seen.place.z, reach)) return;
    if (dot(sample_normal(v, at.y, at.zw), mat3(world_to_view) * texelFetch(front_normals, under).xyz) < 0.0) return;

    vec3 color = to_banded(to_linear(sample_look(corner.index).rgb));
    ivec2 size = view_size;
    int start = 0;
    for (int k = 0; k < level; ++k) {
        start += size.x * size.y;
        size = (size + 1) / 2;
    }
    vec2 place = (corner.pixel - 0.5) / float(1 << level) + 0.5;
    ivec2 middle = ivec2(floor(place));
    for (int k = 0; k < 9; ++k) {
        ivec2 cell = middle + ivec2(k % 3, k / 3) - 1;
        if (any(lessThan(cell, ivec2(0))) || any(greaterThanEqual(cell, size))) continue;
        int index = start + cell.y * size.x + cell.x;
        if (level == 0 && !is_front(index, -corner.place.z, reach)) continue;  // not over outlines
        vec2 away = vec2(cell) + 0.5 - place;
        float weight = exp(-2.0 * dot(away, away));  // spread 0.5
        add(uint(index), float[](weight, weight * color.r, weight * color.g, weight * color.b));
    }
}
