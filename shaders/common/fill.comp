// Fills buffers, each with its word. They are bound beyond what other programs use, so that a fill leaves their
// bindings alone.
#include "common/item.glsl"
layout(std430, binding = FILLED) writeonly buffer Filled { uint filled[]; } fills[FILLS];
uniform uvec4 words, counts;

void main() {
    uint step = gl_NumWorkGroups.x * gl_NumWorkGroups.y * uint(GROUP);
    for (int each = 0; each < FILLS; each++)
        for (uint i = item(); i < counts[each]; i += step) fills[each].filled[i] = words[each];
}
