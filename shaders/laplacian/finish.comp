// The merged picture's levels are summed, and pixels show it, with depth, row, normal and value of the view that won.
// SPLINE: there are coarser levels. CAPTURED: the finest level has bands as well, in place of the merged picture.
#include "common/item.glsl"
#include "common/list.glsl"
#include "common/view.glsl"
#include "laplacian/levels.glsl"
#include "laplacian/pictures.glsl"
#include "pyramidal/pixels.glsl"

layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;
layout(binding = TEXTURE_COLORS) uniform samplerBuffer merged;
layout(binding = TEXTURE_BEST) uniform usamplerBuffer winners;
#if SPLINE
layout(binding = TEXTURE_DETAIL) uniform samplerBuffer coarser;
#endif
#if CAPTURED
layout(binding = TEXTURE_SAMPLES) uniform samplerBuffer finest;  // bands of pixels, and the sum of their shares
uniform float gain;
#elif SHARPEN
layout(binding = TEXTURE_SAMPLES) uniform samplerBuffer smooth_picture;  // level 1 of the merged picture
uniform float gain;  // of the finest band
#endif
#if VALUE
layout(binding = TEXTURE_VALUES) uniform samplerBuffer values;
#endif

void main() {
    uint n = item();
    if (n >= list_count) return;
    int i = int(texelFetch(listed, int(n)).r);
    uvec4 winner = texelFetch(winners, i);
    ivec2 at = split(i, view_size.x);
    Seen seen = Seen(texelFetch(merged, i).rgb, unpack_normal(winner.w), 0.0);
#if CAPTURED
    vec4 own = texelFetch(finest, i), coarse = vec4(0.0);
#if SPLINE
    coarse = expanded(coarser, size, start, at);
#endif
    if (own.a > 0.0) own.rgb *= gain / own.a;
    if (own.a + coarse.a > 0.0) seen.color = from_banded(own.rgb + coarse.rgb);
#elif SHARPEN || SPLINE
    vec3 banded = to_banded(seen.color);
#if SHARPEN
    banded += (gain - 1.0) * (banded - expanded(smooth_picture, size, start, at).rgb);
#endif
#if SPLINE
    banded += expanded(coarser, size, start, at).rgb;
#endif
    seen.color = from_banded(banded);
#endif
#if VALUE
    seen.value = texelFetch(values, int(winner.z)).r;
#endif
    store(i, uintBitsToFloat(winner.y), winner.z, 0, seen);
}
