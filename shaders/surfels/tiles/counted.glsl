// What this filling of lists and the first one have counted (surfels/tiles/filled.glsl), for those that write lists.
layout(binding = TEXTURE_FILLED) uniform usamplerBuffer filled;

uint first_home = texelFetch(filled, 6 * SECOND + 1).r;  // where the lists of homes begin
uint counted_discs = texelFetch(filled, 6 * SECOND + 4).r;
uint disc_count = first_home + counted_discs > uint(entries.length()) ? 0u : counted_discs;  // 0 where there is no room
uint first_disc = SECOND == 0 ? 0u : texelFetch(filled, 4).r;  // the number of the first disc
