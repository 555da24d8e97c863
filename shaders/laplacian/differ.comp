// A view's picture becomes its difference to the merged one, and its shares of that. WHOLE: it becomes the merged one.
// CRISP: all bands but the coarsest are the best view's, or of those that tie; TOP_CRISP: so is that.
#include "common/item.glsl"
#include "common/list.glsl"
#include "laplacian/pictures.glsl"

layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;  // pixels
layout(binding = TEXTURE_COLORS) uniform samplerBuffer merged;
layout(binding = TEXTURE_BEST) uniform usamplerBuffer winners;
layout(std430, binding = STORAGE_VIEW_PICTURE) buffer Picture { uvec2 picture[]; };

void main() {
    uint n = item();
    if (n >= list_count) return;
    int i = int(texelFetch(listed, int(n)).r);
    vec4 all = texelFetch(merged, i);
#if WHOLE
    picture[i] = pack_difference(to_banded(all.rgb), vec2(1.0));
#else
    vec4 seen = unpack_seen_by(picture[i]);
    if (seen.a == 0.0) return;
    vec2 best = unpackHalf2x16(texelFetch(winners, i).x);
    float crisp = seen.a == best.x ? 1.0 / best.y : 0.0, soft = seen.a / all.a;
    picture[i] = pack_difference(to_banded(seen.rgb) - to_banded(all.rgb), vec2(CRISP != 0 ? crisp : soft, TOP_CRISP != 0 ? crisp : soft));
#endif
}
