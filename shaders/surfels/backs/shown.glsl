layout(binding = TEXTURE_DEPTHS) uniform usamplerBuffer depths;  // of what faces the eye, float bits

float shown_at(vec2 place) {
    ivec2 pixel = pixel_at(place);
    return uintBitsToFloat(texelFetch(depths, pixel.y * view_size.x + pixel.x).r);
}
