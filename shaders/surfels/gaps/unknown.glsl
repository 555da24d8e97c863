// Points whose radius is not known yet.
layout(binding = TEXTURE_RADII) uniform samplerBuffer radii;

bool is_listed(uint i) { return texelFetch(radii, int(i)).r == 0.0; }
