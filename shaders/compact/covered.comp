// Lists the pixels that show something, and a dispatch over the list. Its order does not
// matter: each listed pixel is then worked on by itself.
#include "common/item.glsl"
#include "common/view.glsl"

layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;  // float bits
#include "common/list.glsl"

// Each invocation looks at a run of pixels, so that the counter is touched once a run.
const int RUN = 8;

bool is_covered(int pixel) {
    return texelFetch(depths, pixel).r < NO_DEPTH;
}

void main() {
    int pixels = view_size.x * view_size.y;
    int first = int(item()) * RUN;
    int last = min(first + RUN, pixels);
    uint found = 0u;
    for (int i = first; i < last; ++i) found += uint(is_covered(i));
    if (found == 0u) return;
    uint slot = reserve(found);
    for (int i = first; i < last; ++i)
        if (is_covered(i)) list[slot++] = uint(i);
}
