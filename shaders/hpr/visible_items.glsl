// Lists the visible points that lie in a sector. COPIES: but for those in whose place a lower row is. SAMPLED: a list says which points there are.
#if SAMPLED
layout(binding = TEXTURE_DRAWN_ROWS) uniform usamplerBuffer drawn_rows;
#endif
#if COPIES
layout(binding = TEXTURE_COPIES) uniform usamplerBuffer copies;
#endif
layout(binding = TEXTURE_HOMES) uniform usamplerBuffer homes;
layout(binding = TEXTURE_VISIBLE) uniform usamplerBuffer visible;

bool is_listed(uint i) {
#if SAMPLED
    uint row = texelFetch(drawn_rows, int(i)).r;
#else
    uint row = i;
#endif
#if COPIES
    if (texelFetch(copies, int(row)).r != 0u) return false;
#endif
    return texelFetch(visible, int(row)).r != 0u && texelFetch(homes, int(i)).r != NOTHING;
}
