// The picture over the whole viewport, and checks where it is transparent. Where both have the same size, each pixel
// is its own.

layout(binding = TEXTURE_PICTURE) uniform sampler2D picture;  // sRGB as it is, row 0 at the top
uniform ivec2 corner;  // of the viewport, pixels from the window's lower left
uniform ivec2 size;    // of the viewport
uniform float light;   // factor on the colours
out vec4 color;

const int CHECK = 12;  // pixels

void main() {
    vec2 at = (gl_FragCoord.xy - vec2(corner)) / vec2(size);
    vec4 shown = texture(picture, vec2(at.x, 1.0 - at.y));  // the window's rows count from the bottom
    ivec2 cell = ivec2(gl_FragCoord.xy) / CHECK;
    float check = (cell.x + cell.y) % 2 == 0 ? 0.42 : 0.5;
    color = vec4(light * mix(vec3(check), shown.rgb, shown.a), 1.0);
}
