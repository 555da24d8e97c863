// What this filling of lists and the first one have counted (surfels/tiles/filled.glsl), for those that write lists.
layout(binding = TEXTURE_FILLED) uniform usamplerBuffer filled;

uint first_home = texelFetch(filled, 6 * SECOND + 1).r;  // where the lists of homes begin
uint first_disc = SECOND == 0 ? 0u : texelFetch(filled, 4).r;  // the number of the first disc

// How many discs are listed; 0 where their lists have no room.
uint disc_count() {
    uint discs = texelFetch(filled, 6 * SECOND + 4).r;
    return first_home + discs > uint(entries.length()) ? 0u : discs;
}
