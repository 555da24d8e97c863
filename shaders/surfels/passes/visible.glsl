// What a fragment's pixel shows.
#include "surfels/passes/look.glsl"

layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;

vec3 visible_normal() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uint visible = texelFetch(rows, pixel.y * view_size.x + pixel.x).r;
    return visible == NOTHING ? vec3(0.0) : normal_of(texelFetch(looks, int(visible)).xy);
}
