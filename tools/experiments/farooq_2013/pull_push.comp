// Image reconstruction of points by pull and push, as pull_push_kernels.py has it. Not a shader of Scan4D.
// STEP 0: clear. 1: the least depth of each pixel. 2: the first point there. 3: its cell. 4: pull. 5: push.
// 6: write the picture.
layout(local_size_x = 128) in;
layout(std430, binding = 0) readonly buffer Points { float points[]; };
layout(std430, binding = 1) buffer Keys { uint keys[]; };
layout(std430, binding = 2) buffer Best { uint best[]; };
layout(std430, binding = 3) buffer Cells { float cells[]; };
layout(std430, binding = 4) writeonly buffer Depths { float depths[]; };
layout(std430, binding = 5) writeonly buffer Rows { uint rows[]; };
layout(std430, binding = 6) writeonly buffer Colors { uint colors[]; };
layout(std430, binding = 7) writeonly buffer Normals { float normals[]; };
uniform uint count;        // of points, or of cells
uniform float view[15];
uniform ivec2 size;        // of the picture, or of the level that is written, cells
uniform ivec2 other_size;  // of the level that is read
uniform int start, other;  // where these levels begin
uniform float edge;        // of the cells that are written, pixels

const int CELL = 12;
const float EMPTY = uintBitsToFloat(0x7F800000u), STEEPEST = 0.1;

bool reaches(int cell, float x, float y) {
    precise float right = x - cells[cell + 2], down = y - cells[cell + 3];
    precise float away = (cells[cell + 5] * right + cells[cell + 6] * down) / max(cells[cell + 7], STEEPEST);
    precise float squared = right * right + down * down + away * away;
    return squared <= cells[cell + 4] * cells[cell + 4];
}

float dotted(int row, uint from) {
    precise float sum = view[5 * row] * points[from] + view[5 * row + 1] * points[from + 1u]
                      + view[5 * row + 2] * points[from + 2u];
    return sum;
}

// Where a point is in view space; its pixel coordinates and pixels per unit.
bool placed(uint i, out vec3 at, out vec3 pixel) {
    precise vec3 sum = vec3(dotted(0, 10u * i), dotted(1, 10u * i), dotted(2, 10u * i)) + vec3(view[3], view[8], view[13]);
    at = sum;
    if (-at.z <= 0.0) return false;
    precise float scale = view[14] > 0.0 ? view[14] / -at.z : -view[14];
    precise float x = view[4] + at.x * scale, y = view[9] - at.y * scale;
    pixel = vec3(x, y, scale);
    return x >= 0.0 && y >= 0.0 && x < float(size.x) && y < float(size.y);
}

float channel(float value) {
    return value <= 0.0031308 ? 12.92 * value : 1.055 * pow(value, 1.0 / 2.4) - 0.055;
}

#if STEP == 4 || STEP == 5
// The cell that is read, or -1 outside of its level.
int cell_at(ivec2 at) {
    if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, other_size))) return -1;
    return CELL * (other + at.y * other_size.x + at.x);
}

void merge(ivec2 cell, int out_cell) {
    precise vec2 middle = (vec2(cell) + 0.5) * edge;
#if STEP == 4
    ivec2 low = 2 * cell;
#else
    ivec2 low = (cell + 1) / 2 - 1;
#endif
    float near = EMPTY, far = EMPTY;
    for (int k = 0; k < 4; ++k) {
        int from = cell_at(low + ivec2(k & 1, k >> 1));
        if (from < 0 || cells[from] >= near || !reaches(from, middle.x, middle.y)) continue;
        near = cells[from];
        far = cells[from + 1];
    }
#if STEP == 4
    cells[out_cell] = near;
    if (near == EMPTY) return;
#else
    if (near == EMPTY || cells[out_cell] <= far) return;
#endif
    precise float sums[CELL], total = 0.0;
    for (int j = 0; j < CELL; ++j) sums[j] = 0.0;
    float farthest = far;
    for (int k = 0; k < 4; ++k) {
        ivec2 step = ivec2(k & 1, k >> 1);
        int from = cell_at(low + step);
        if (from < 0 || !(cells[from] <= far) || !reaches(from, middle.x, middle.y)) continue;
#if STEP == 4
        float weight = 1.0;
#else
        float weight = (step.x == ((cell.x & 1) ^ 1) ? 0.75 : 0.25) * (step.y == ((cell.y & 1) ^ 1) ? 0.75 : 0.25);
#endif
        for (int j = 2; j < CELL; ++j) sums[j] += weight * cells[from + j];
        farthest = max(farthest, cells[from + 1]);
        total += weight;
    }
    for (int j = 2; j < CELL; ++j) sums[j] /= total;
    precise float length = sqrt(sums[5] * sums[5] + sums[6] * sums[6] + sums[7] * sums[7]);
    if (length > 0.0) for (int j = 5; j < 8; ++j) sums[j] /= length;
    cells[out_cell] = near;
    cells[out_cell + 1] = farthest;
    for (int j = 2; j < CELL; ++j) cells[out_cell + j] = sums[j];
}
#endif

void main() {
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 128u + gl_LocalInvocationID.x;
    if (i >= count) return;
#if STEP == 0
    keys[i] = 0xFFFFFFFFu;
    best[i] = 0xFFFFFFFFu;
#elif STEP == 1 || STEP == 2
    vec3 at, pixel;
    if (!placed(i, at, pixel)) return;
    int cell = int(pixel.y) * size.x + int(pixel.x);
#if STEP == 1
    atomicMin(keys[cell], floatBitsToUint(-at.z));
#else
    if (keys[cell] == floatBitsToUint(-at.z)) atomicMin(best[cell], i);
#endif
#elif STEP == 3
    int cell = CELL * int(i);
    cells[cell] = EMPTY;
    vec3 at, pixel;
    if (best[i] == 0xFFFFFFFFu || !placed(best[i], at, pixel)) return;
    uint from = 10u * best[i];
    vec3 normal = vec3(dotted(0, from + 3u), -dotted(1, from + 3u), dotted(2, from + 3u));
    precise float facing = normal.z * -at.z + normal.y * at.y - normal.x * at.x;
    if ((view[14] > 0.0 ? facing : normal.z) < 0.0) normal = -normal;
    cells[cell] = cells[cell + 11] = -at.z;
    float radius = points[from + 9u];
    cells[cell + 1] = -at.z + radius;
    cells[cell + 2] = pixel.x;
    cells[cell + 3] = pixel.y;
    cells[cell + 4] = radius * pixel.z;
    for (int k = 0; k < 3; ++k) {
        cells[cell + 5 + k] = normal[k];
        cells[cell + 8 + k] = points[from + 6u + uint(k)];
    }
#elif STEP == 4 || STEP == 5
    merge(ivec2(int(i) % size.x, int(i) / size.x), CELL * (start + int(i)));
#else
    int cell = CELL * int(i);
    rows[i] = 0xFFFFFFFFu;
    depths[i] = cells[cell] == EMPTY ? EMPTY : cells[cell + 11];
    vec3 normal = vec3(cells[cell + 5], -cells[cell + 6], cells[cell + 7]);
    vec3 color = vec3(channel(cells[cell + 8]), channel(cells[cell + 9]), channel(cells[cell + 10]));
    colors[i] = packUnorm4x8(vec4(color, 1.0));
    for (int k = 0; k < 3; ++k)
        normals[3u * i + uint(k)] = view[k] * normal.x + view[5 + k] * normal.y + view[10 + k] * normal.z;
#endif
}
