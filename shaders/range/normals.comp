// Normals of the samples in listed tiles, once for each: on an octahedron's net, in the pod's space; 0: unknown.
#include "common/item.glsl"
#include "common/list.glsl"
#include "common/octahedron.glsl"
#include "range/rows.glsl"

layout(std430, binding = STORAGE_RANGE_NORMALS) buffer Normals { uint range_normals[]; };
layout(std430, binding = STORAGE_RANGE_ROWS) buffer Made { uint made[]; };  // for each row of a tile, whether it has them

uniform int page;       // the first sample of those that are bound
uniform int page_size;

const int REACH = 2;  // samples to each side, as viewer/scan/grid_normals.py has it

// Sums over a column of samples of the surface that the middle one is on: weights, these times rows and rows squared,
// and times places; and the middle one.
struct Column {
    vec3 count;
    vec3 places, places_v;
    float depth;  // of the view's kind; +inf: none
};

// Of a coarser level, which has less noise, only the nearest count: they reach as far.
float weight_at(int level, int apart) { return max(float((level == 0 ? REACH : 1) + 1 - abs(apart)), 0.0); }

Column column_at(RowOfSamples row, ivec2 uv, vec3 zero) {
    vec4 middle = placed_sample(row.view, row.range, row.level, uv);
    Column column = Column(vec3(0.0), vec3(0.0), vec3(0.0), middle.w);
    if (isinf(middle.w)) return column;
    for (int y = -REACH; y <= REACH; ++y) {
        vec4 other = y == 0 ? middle : placed_sample(row.view, row.range, row.level, uv + ivec2(0, y));
        if (!same_surface(row.view, row.level, middle.w, other.w)) continue;
        float weight = weight_at(row.level, y), v = float(y);
        column.count += weight * vec3(1.0, v, v * v);
        column.places += weight * (other.xyz - zero);
        column.places_v += weight * v * (other.xyz - zero);
    }
    return column;
}

// The normal of the plane through the samples of some columns around the middle one, in pod space, towards the pod; zero
// where they span none. place: of the middle one.
vec3 plane_normal(RowOfSamples row, Column columns[2 * REACH + 1], vec3 place) {
    // Sums over (1, u, v), (uu, uv, vv), and of places times 1, u, v.
    vec3 count = vec3(0.0), squares = vec3(0.0), places = vec3(0.0), places_u = vec3(0.0), places_v = vec3(0.0);
    for (int k = 0; k < 2 * REACH + 1; ++k) {
        if (!same_surface(row.view, row.level, columns[REACH].depth, columns[k].depth)) continue;
        float weight = weight_at(row.level, k - REACH), u = float(k - REACH);
        vec3 sums = weight * columns[k].count;
        count += vec3(sums.x, u * sums.x, sums.y);
        squares += vec3(u * u * sums.x, u * sums.y, sums.z);
        places += weight * columns[k].places;
        places_u += weight * u * columns[k].places;
        places_v += weight * columns[k].places_v;
    }
    squares = count.x * squares - vec3(count.y * count.y, count.y * count.z, count.z * count.z);
    if (!(squares.x * squares.z - squares.y * squares.y > 1e-6 * squares.x * squares.z)) return vec3(0.0);
    places_u = count.x * places_u - count.y * places;
    places_v = count.x * places_v - count.z * places;
    vec3 normal = cross(squares.x * places_v - squares.y * places_u, squares.z * places_u - squares.y * places_v);
    float size = length(normal);
    if (!(size > 0.0)) return vec3(0.0);
    float away = row.view.kind == RANGE_HEIGHT ? -normal.z : dot(normal, place);
    return normal * (away > 0.0 ? -1.0 : 1.0) / size;
}

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint word = texelFetch(listed_tiles, int(i) / RANGE_TILE).r;
    uint place = (word & 0xFFFFFFu) * uint(RANGE_TILE) + i % uint(RANGE_TILE);
    RowOfSamples row;
    if (word >> 24 > 1u || made[place] != 0u || is_empty(range_tile(int(word & 0xFFFFFFu)))) return;
    if (!row_of_samples(i, row)) return;
    int first = sample_index(row.range, row.first) - page, end = first + row.last.x - row.first.x;
    if (end <= 0 || first >= page_size) return;
    if (first >= 0 && end <= page_size) made[place] = 1u;  // else the next page has the rest
    Column columns[2 * REACH + 1];
    // Places are summed relative to one of them, so that float32 keeps what they differ by.
    vec3 zero = sample_place(row.view, row.level, vec2(row.first), 0.0);
    for (int x = row.first.x; x < row.last.x; ++x) {
        int index = sample_index(row.range, ivec2(x, row.first.y));
        if (!is_sample(index)) continue;
        zero = sample_place(row.view, row.level, vec2(x, row.first.y), sample_depth(index));
        break;
    }
    for (int k = 1; k < 2 * REACH + 1; ++k)  // those before the first, which move on
        columns[k] = column_at(row, row.first + ivec2(k - REACH - 1, 0), zero);
    for (ivec2 uv = row.first; uv.x < row.last.x; ++uv.x) {
        for (int k = 0; k < 2 * REACH; ++k) columns[k] = columns[k + 1];
        columns[2 * REACH] = column_at(row, uv + ivec2(REACH, 0), zero);
        if (isinf(columns[REACH].depth)) continue;
        int index = sample_index(row.range, uv);
        if (index < page || index >= page + page_size) continue;
        vec3 here = sample_place(row.view, row.level, vec2(uv), columns[REACH].depth);
        range_normals[index - page] = pack_normal(plane_normal(row, columns, here));
    }
}
