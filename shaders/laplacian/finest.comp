// The finest band: what a view's differences are beyond level 1, by its share of the pixel. Shared differences sum to 0, so
// that level 1 alone is left.
#include "common/item.glsl"
#include "common/list.glsl"
#include "common/view.glsl"
#include "laplacian/levels.glsl"
#include "laplacian/pictures.glsl"

layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;  // pixels
layout(binding = TEXTURE_LOOKS) uniform usamplerBuffer picture;
layout(binding = TEXTURE_SAMPLES) uniform samplerBuffer bands;
layout(std430, binding = STORAGE_MERGED) buffer Merged { vec4 merged[]; };

void main() {
    uint n = item();
    if (n >= list_count) return;
    int i = int(texelFetch(listed, int(n)).r);
    float share = unpack_shares(texelFetch(picture, i).xy).x;
    if (share == 0.0) return;
    vec3 smooth_difference = expanded(bands, size, start, split(i, view_size.x)).rgb;
    merged[i].rgb = from_banded(to_banded(merged[i].rgb) - share * smooth_difference);
}
