// One pixel of the picture for one pixel of the window, nothing in between.
layout(binding = 0) uniform sampler2D picture;  // sRGB as it is, row 0 at the top
uniform ivec2 corner;  // of the viewport, pixels from the window's lower left
out vec4 color;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - corner;
    int bottom = textureSize(picture, 0).y - 1;  // the window's rows count from there
    color = vec4(texelFetch(picture, ivec2(at.x, bottom - at.y), 0).rgb, 1.0);
}
