// The listed faces go to the pixels whose centres they hold, with their depth there. LANES: invocations for a quad.
#include "hpr/drawn_faces.glsl"

layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;

void visit_pixel(Drawn face, ivec2 pixel, uint number) {
    vec3 shares = shares_at(face.pixels[0], face.pixels[1], face.pixels[2], vec2(pixel) + 0.5);
    if (!is_inside(shares)) return;
    visit(uint(pixel.y * view_size.x + pixel.x), floatBitsToUint(depth_at(face.depths, shares)), number);
}

void scatter(uint i) {
    uint quad = texelFetch(listed, int(i / uint(LANES))).r;
    Faces faces = faces_of(quad);
    for (int t = 0; t < faces.count; ++t) {
        Drawn face = drawn_face(faces.corners[t]);
        if (!face.there || !is_surface(faces.corners[t])) continue;
        ivec4 pixels = pixels_in(face);
#if LANES == 1
        for (int y = pixels.y; y < pixels.w; ++y)
            for (int x = pixels.x; x < pixels.z; ++x) visit_pixel(face, ivec2(x, y), 2u * quad + uint(t));
#else
        ivec2 size = max(pixels.zw - pixels.xy, ivec2(0));
        for (int n = int(i % uint(LANES)); n < size.x * size.y; n += LANES)
            visit_pixel(face, pixels.xy + split(n, size.x), 2u * quad + uint(t));
#endif
    }
}
