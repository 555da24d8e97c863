// A plain scatter of points or discs: the least depth of each pixel, then its colour. Not a shader of Scan4D.
// BITS 32: keep the least depth, then colour where it is equal. BITS 64: keep depth and point in one word,
// then look the colour up. STEP 0: clear. 1: scatter. 2: colour. DISCS: discs that face the camera.
#if BITS == 64
#extension GL_ARB_gpu_shader_int64 : require
#extension GL_NV_shader_atomic_int64 : require
#define KEY uint64_t
const KEY FAR = 0xFFFFFFFFFFFFFFFFUL;
#else
#define KEY uint
const KEY FAR = 0xFFFFFFFFu;
#endif
layout(local_size_x = 128) in;
layout(std430, binding = 0) readonly buffer Positions { float positions[]; };
layout(std430, binding = 1) readonly buffer Colors { uint colors[]; };
layout(std430, binding = 2) buffer Keys { KEY keys[]; };
layout(std430, binding = 3) buffer Picture { uint picture[]; };
uniform mat4 to_clip;
uniform uint count;     // of points, or of pixels
uniform ivec2 size;     // pixels
uniform float radius;   // pixels at a distance of 1

void visit(ivec2 pixel, uint depth, uint point) {
    int cell = pixel.y * size.x + pixel.x;
#if BITS == 64
    KEY key = (KEY(depth) << 32) | KEY(point);
    if (keys[cell] > key) atomicMin(keys[cell], key);
#elif STEP == 1
    if (keys[cell] > depth) atomicMin(keys[cell], depth);
#else
    if (keys[cell] == depth) picture[cell] = colors[point];
#endif
}

void main() {
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 128u + gl_LocalInvocationID.x;
    if (i >= count) return;
#if STEP == 0
    keys[i] = FAR;
    picture[i] = 0xFF000000u;
#elif STEP == 2 && BITS == 64
    KEY key = keys[i];
    if (key != FAR) picture[i] = colors[uint(key & 0xFFFFFFFFUL)];
#else
    vec4 clip = to_clip * vec4(positions[3u * i], positions[3u * i + 1u], positions[3u * i + 2u], 1.0);
    if (clip.w <= 0.0) return;
    vec2 center = (clip.xy / clip.w * vec2(0.5, -0.5) + 0.5) * vec2(size);
    uint depth = floatBitsToUint(clip.w);
#if DISCS
    float reach = max(0.5, radius / clip.w);
    ivec2 low = max(ivec2(ceil(center - reach - 0.5)), ivec2(0));
    ivec2 high = min(ivec2(floor(center + reach - 0.5)), size - 1);
    for (int y = low.y; y <= high.y; y++)
        for (int x = low.x; x <= high.x; x++) {
            vec2 away = vec2(x, y) + 0.5 - center;
            if (dot(away, away) <= reach * reach) visit(ivec2(x, y), depth, i);
        }
#else
    ivec2 pixel = ivec2(floor(center));
    if (all(greaterThanEqual(pixel, ivec2(0))) && all(lessThan(pixel, size))) visit(pixel, depth, i);
#endif
#endif
}
