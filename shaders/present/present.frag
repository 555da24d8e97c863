// One pixel of the picture for one pixel of the window, nothing in between.
layout(std430, binding = 0) readonly buffer Picture { uint picture[]; };  // RGBA8, row 0 at the top
uniform ivec2 corner;  // of the viewport, pixels from the window's lower left
uniform ivec2 size;    // of the picture, pixels
out vec4 color;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - corner;
    // The window's rows count from the bottom.
    color = vec4(unpackUnorm4x8(picture[(size.y - 1 - at.y) * size.x + at.x]).rgb, 1.0);
}
