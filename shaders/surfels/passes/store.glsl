// The blended colour and normal of a pixel, for Surface.own.

#if HAS_COLORS
layout(std430, binding = STORAGE_COLOR) writeonly buffer Color { uint own_colors[]; };
#endif
layout(std430, binding = STORAGE_NORMAL) writeonly buffer Normal { float own_normals[]; };

// light, normal: sums of what `look.glsl` gives, times weights that add up to `total`; row: what is
// shown, where those are nothing. coverage: of the pixel.
void store_mean(int index, vec3 light, vec3 normal, float total, float coverage, uint row) {
    if (total == 0.0) {
        uvec2 look = texelFetch(looks, int(row)).xy;
        light = light_of(look);
        normal = normal_of(look);
        total = 1.0;
    }
#if HAS_COLORS
    own_colors[index] = packUnorm4x8(vec4(srgb_of_light(light, total), coverage));
#endif
    own_normals[3 * index] = normal.x;
    own_normals[3 * index + 1] = normal.y;
    own_normals[3 * index + 2] = normal.z;
}
