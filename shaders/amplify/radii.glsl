// The points' own radii, where they have any.
#include <bindings>

layout(binding = TEXTURE_RADII) uniform samplerBuffer radii;
