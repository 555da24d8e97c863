// Gives each covered pixel, as its own, what its row has. CHANNEL 0 colour, 1 normal, 2 value. HAS_ROWS: whether rows have
// any; SAMPLES: which are samples of range views. IS_DEPTH: whether the value is the depth. What a pixel without a row gets is what shading takes for it: plain, none, NaN.
// PART: the texels are those of a run of all rows, and other pixels wait for their own run.
// SAMPLED: gives some pixels alone, covered or not, one after another.
#include "common/view.glsl"
#include "common/item.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
layout(binding = TEXTURE_VALUES) uniform samplerBuffer values;
#if SAMPLES
#include "range/of_rows.glsl"
#endif
#if CHANNEL == 0
layout(std430, binding = STORAGE_COLOR) writeonly buffer Color { uint own[]; };
uniform vec3 plain;  // sRGB
#elif CHANNEL == 1
layout(std430, binding = STORAGE_NORMAL) writeonly buffer Normal { float own[]; };
#else
layout(std430, binding = STORAGE_VALUE) writeonly buffer Value { float own[]; };
#endif
#if PART
uniform uint first, part_count;
#endif
#if SAMPLED
uniform int stride;  // one in so many of each line, and of the lines
#endif

void main() {
    int to = int(item()), index = to;
#if SAMPLED
    int across = (view_size.x + stride - 1) / stride;
    ivec2 pixel = stride * ivec2(to % across, to / across);
    if (pixel.y >= view_size.y) return;
    index = pixel.y * view_size.x + pixel.x;
#else
    if (index >= view_size.x * view_size.y || texelFetch(depths, index).r >= NO_DEPTH) return;
#endif
#if IS_DEPTH
    own[to] = uintBitsToFloat(texelFetch(depths, index).r);
#else
    uint row = texelFetch(rows, index).r;
#if PART
    row -= first;
    if (row >= part_count) return;
#endif
    bool known = HAS_ROWS != 0 && row != NOTHING;
    vec4 value = vec4(0.0);
#if SAMPLES && CHANNEL == 0
    if (known) value.rgb = sample_color(row);
#elif SAMPLES && CHANNEL == 1
    if (known) value.xyz = normal_of_sample(row);
#else
    if (known) value = texelFetch(values, int(row));
#endif
#if CHANNEL == 0
    own[to] = packUnorm4x8(vec4(known ? value.rgb : plain, 1.0));
#elif CHANNEL == 1
    for (int k = 0; k < 3; ++k) own[3 * to + k] = value[k];
#else
    own[to] = known ? value.r : uintBitsToFloat(0x7FC00000u);
#endif
#endif
}
