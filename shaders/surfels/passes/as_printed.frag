// The second pass of splats as Slomp 2014 prints it (V-B): its colour, transparent as its mask. No fragment is discarded.
#include <params>

flat in vec3 color;  // sRGB
in vec2 local;

layout(location = 0) out vec4 out_color;  // times its opacity, and that
layout(location = 1) out float out_key;   // reversed depth, 0 where the mask ends

void main() {
    float t = dot(local, local) / mask_limit;
    float opacity = t > 1.0 ? 0.0 : exp(-falloff * t);
    out_color = opacity * vec4(color, 1.0);
    out_key = opacity > 0.0 ? gl_FragCoord.z : 0.0;
}
