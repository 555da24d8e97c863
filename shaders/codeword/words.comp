// Words of elements (viewer/codewords/emit_kernels.py, `emit`): whole numbers, but for the rows of discs too large for
// 32 bits. PASS 0 counts those of each line, PASS 1 writes them, in any order within a line. An element's words are divided
// among `slices` invocations, since drivers may bound how often loops turn. BEYOND: some are larger than the table's.
#include "common/item.glsl"
#include "codeword/element.glsl"
// backends/codeword/encoder.py.
#include <params>

layout(binding = TEXTURE_ELEMENTS) uniform usamplerBuffer elements;
layout(binding = TEXTURE_SHAPES) uniform usamplerBuffer shapes;  // viewer/codewords/tables.py
layout(binding = TEXTURE_SHAPE_ROWS) uniform usamplerBuffer shape_rows;
#if PASS == 0
layout(std430, binding = STORAGE_CURSORS) buffer Counts { uint counts[]; };
#else
layout(binding = TEXTURE_LOOKS) uniform usamplerBuffer heads;  // of rows
#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;
#endif
layout(std430, binding = STORAGE_CURSORS) buffer Cursors { uint cursors[]; };
layout(std430, binding = STORAGE_LINE_WORDS) writeonly buffer LineWords { uvec2 words[]; };
layout(std430, binding = STORAGE_RANKS) writeonly buffer Ranks { uint ranks[]; };
uniform float nearest, farthest;  // depths of Z = 0 and its largest
#endif

uniform int slices;

const int HALF = 4, WIDTH = 8, LINES = 4;  // of a bitmap: rows below its middle, columns, rows of a tile's word
const uint LARGE = 1u << 31, EMPTY_ROW = 7u, EMPTY_SCANS = EMPTY_ROW * 0x41041u;
const ivec2 NONE = ivec2(1 << 24, -(1 << 24));
#if BEYOND
const float MOST_EXACT = 16384.0;  // of size times normal_parts: the rule of tables in 32 bits
const float MOST_RADIUS = 2900.0;  // in half pixels, of which floats know rows to a pixel
#endif

uint row, head, depth_step;
int size, half_rows;
ivec2 corner, normal;
uint entry;  // of the table
#if BEYOND
bool in_table;
#endif

void put(int mode, uint scans, int column, int line) {
#if PASS == 0
    atomicAdd(counts[line], 1u);
#else
    uint at = atomicAdd(cursors[line], 1u);
    if (at >= uint(min(words.length(), ranks.length()))) return;
    words[at] = uvec2(uint(mode) | scans << 1 | head << 25, head >> 7 | uint(column) << 14 | depth_step << 23);
    ranks[at] = row;
#endif
}

#if BEYOND
// The rule of viewer/codewords/tables.py.
bool is_inside(int u, int v) {
    uint parts = uint(normal_parts * normal_parts), across = uint(normal.x * u + normal.y * v);
    uint form = parts * uint(u * u + v * v) + across * across, limit = uint(2 * size) * uint(normal_parts);
    return uint(size_parts * size_parts) * form <= limit * limit;
}

// First and last column of the k-th row below the middle of a shape that is larger than those of the table.
ivec2 computed_span(int k) {
    int v = 2 * k + 1;
    vec2 tilt = vec2(normal) / float(normal_parts);
    float radius = 2.0 * float(size) / float(size_parts), a = 1.0 + tilt.x * tilt.x;
    float root = a * radius * radius - float(v) * float(v) * (a + tilt.y * tilt.y);
    float middle = -tilt.x * tilt.y * float(v) / a, reach = sqrt(max(root, 0.0)) / a;
    int begin = int(ceil(0.5 * (middle - reach - 1.0))), end = int(floor(0.5 * (middle + reach - 1.0)));
    if (float(size) * float(normal_parts) > MOST_EXACT || radius > MOST_RADIUS)
        return root >= 0.0 && begin <= end ? ivec2(begin, end) : NONE;
    // Rounding may be off by a pixel, which the rule sets right.
    bool earlier = is_inside(2 * begin - 1, v), later = is_inside(2 * end + 3, v);
    begin += earlier ? -1 : is_inside(2 * begin + 1, v) ? 0 : 1;
    end += later ? 1 : is_inside(2 * end + 1, v) ? 0 : -1;
    return begin <= end && is_inside(2 * begin + 1, v) ? ivec2(begin, end) : NONE;
}
#endif

// Rows below the middle that a shape may have.
int most_rows() {
    vec2 tilt = vec2(normal) / float(normal_parts);
    float a = 1.0 + tilt.x * tilt.x;
    return int(float(size) / float(size_parts) * sqrt(a / (a + tilt.y * tilt.y)) + 0.5) + 1;
}

// First and last column of a row of the picture, cut to this.
ivec2 row_span(int y) {
    if (y >= min(corner.y + half_rows, picture_size.y)) return NONE;
    bool is_below = y >= corner.y;
    int k = is_below ? y - corner.y : corner.y - 1 - y;
    uint field = entry >> 6 * (HALF - 1 - k);
    uint columns = texelFetch(shape_rows, entry < LARGE ? 0 : int(entry - LARGE) + k).r;
    ivec2 span = HALF - 1 - ivec2(field >> 3 & 7u, field & 7u);
    if (entry >= LARGE) span = ivec2(columns & 255u, columns >> 8) - table_reach;
#if BEYOND
    if (!in_table) span = computed_span(k);
#endif
    if (span.x > span.y) return NONE;
    if (!is_below) span = -1 - span.yx;
    span = ivec2(max(corner.x + span.x, 0), min(corner.x + span.y, picture_size.x - 1));
    return span.x <= span.y ? span : NONE;
}

int place_of(ivec2 at) {
    int normals = 2 * steepest + 1, place = (at.y + steepest) * normals + at.x + steepest;
    return min(place, normals * normals - 1 - place);
}

// The words of full rows, from a strip on.
void put_tiles(int from_strip, int slice) {
    int top = max(corner.y - half_rows, 0), bottom = min(corner.y + half_rows, picture_size.y) - 1;
    while (top <= bottom && row_span(top).y < 0) ++top;
    for (int begin = top + LINES * slice; begin <= bottom; begin += LINES * slices) {
        ivec2 a = row_span(begin), b = row_span(begin + 1), c = row_span(begin + 2), d = row_span(begin + 3);
        ivec4 first = ivec4(a.x, b.x, c.x, d.x), last = ivec4(a.y, b.y, c.y, d.y);
        int left = min(min(first.x, first.y), min(first.z, first.w)), right = max(max(last.x, last.y), max(last.z, last.w));
        if (left > right) continue;
        int column = max(left, from_strip * stride), strip = from_strip;
        while ((strip + 1) * stride <= column) ++strip;
        while (column <= right) {
            int strip_end = min((strip + 1) * stride, picture_size.x) - 1;
            ivec4 from = max(first, column), to = min(last, min(column + WIDTH - 1, strip_end));
            uvec4 some = uvec4(lessThanEqual(from, to)), fields = some * uvec4(from - column | to - column << 3);
            fields += EMPTY_ROW * (1u - some);
            uint scans = fields.x | fields.y << 6 | fields.z << 12 | fields.w << 18;
            if (scans != EMPTY_SCANS) put(1, scans, column - strip * stride, strip * picture_size.y + begin);
            column += WIDTH;
            if (column > strip_end) column = ++strip * stride;
        }
    }
}

void main() {
    if (item() >= item_count) return;
    int number = int(item() / uint(slices)), slice = int(item() - uint(number) * uint(slices));
    uvec4 element = texelFetch(elements, number);
    size = int(element.z);
    if (size == 0) return;
    corner = corner_of(element);
    normal = normal_of(element);
#if PASS == 1
#if SAMPLED
    row = texelFetch(drawn_rows, number).r;
#else
    row = uint(number);
#endif
    head = texelFetch(heads, int(row)).r;
    // In perspective inverse depths are counted; a ratio of differences loses nothing where all are nearly the same.
    float depth = uintBitsToFloat(element.w), part = farthest > nearest ? (depth - nearest) / (farthest - nearest) : 0.0;
    if (is_inverse) part *= farthest / depth;
    depth_step = uint(roundEven(clamp(part, 0.0, 1.0) * MOST_DEPTH));
#endif
    entry = texelFetch(shapes, min(size, sizes - 1) * half_count + place_of(normal)).r;
    half_rows = min(entry < LARGE ? HALF : table_reach, most_rows());
#if BEYOND
    in_table = size < sizes;
    if (!in_table) {
        entry = LARGE;
        half_rows = most_rows();
    }
#endif
    int from_strip = 0;
    ivec2 lowest = corner - HALF;
    if (entry < LARGE && all(greaterThanEqual(lowest, ivec2(0))) && all(lessThan(lowest, picture_size))) {
        int strip = lowest.x / stride;
        if (slice == 0) put(0, entry, lowest.x - strip * stride, strip * picture_size.y + lowest.y);
        from_strip = strip + 1;
        int strip_end = min(from_strip * stride, picture_size.x);
        if (corner.x + HALF - 1 < strip_end || strip_end == picture_size.x) return;
    }
    put_tiles(from_strip, slice);
}
