// Goes through all samples of a level. WORK 0: their depths; 1: as the pixels of a texture, in place of a buffer; 2: their
// places in the picture's space; 3: these, where there is a sample; 4: their normals.
#include "common/item.glsl"
#include "range/samples.glsl"

layout(std430, binding = STORAGE_WORDS) writeonly buffer Words { float sums[]; };  // so that something is computed
layout(binding = TEXTURE_PICTURE) uniform sampler2D image;
uniform int run;  // samples of a row that an invocation goes through

void main() {
    uint i = item();
    if (i >= item_count) return;
    RangeView view = range_view(0);
    RangeLevel level = range_level(view, 0);
    int runs = (level.size.x + run - 1) / run;
    ivec2 uv = ivec2(run * (int(i) % runs), int(i) / runs);
    int end = min(uv.x + run, level.size.x);
    vec3 sum = vec3(0.0);
    for (; uv.x < end; ++uv.x) {
        int index = sample_index(level, uv);
#if WORK == 0
        sum += sample_depth(index);
#elif WORK == 1
        sum += texelFetch(image, uv, 0).r;
#elif WORK == 4
        sum += sample_normal(view, 0, uv);
#else
        vec3 place = to_screen_view(view, sample_place(view, level, 0, vec2(uv), sample_depth(index)));
        sum += WORK == 2 || is_sample(index) ? place : vec3(0.0);
#endif
    }
    sums[i] = sum.x + sum.y + sum.z;
}
