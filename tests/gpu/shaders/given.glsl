// Items that visit as many cells in a row as they say, beginning with a given one, with given keys.
layout(binding = 0) uniform usamplerBuffer given;  // first cell, how many, key, item

void scatter(uint i) {
    uvec4 v = texelFetch(given, int(i));
    for (uint k = 0u; k < v.y; ++k) visit(v.x + k, v.z, v.w);
}
