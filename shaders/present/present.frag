// The picture over the whole viewport. Where both have the same size, each pixel is its own.

layout(binding = TEXTURE_PICTURE) uniform sampler2D picture;  // sRGB as it is, row 0 at the top
uniform ivec2 corner;  // of the viewport, pixels from the window's lower left
uniform ivec2 size;    // of the viewport
out vec4 color;

void main() {
    vec2 at = (gl_FragCoord.xy - vec2(corner)) / vec2(size);
    color = vec4(texture(picture, vec2(at.x, 1.0 - at.y)).rgb, 1.0);  // the window's rows count from the bottom
}
