// Fills a buffer with one word. Bound beyond what other programs use, so that a fill leaves their bindings alone.
#include "common/item.glsl"
layout(std430, binding = FILLED) writeonly buffer Filled { uint filled[]; };
uniform uint word, words;

void main() {
    uint groups = gl_NumWorkGroups.x * gl_NumWorkGroups.y;
    for (uint i = item(); i < words; i += groups * uint(GROUP)) filled[i] = word;
}
