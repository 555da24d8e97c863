// The blended colour and normal of a pixel, for Surface.own.

#if HAS_COLORS
layout(std430, binding = STORAGE_COLOR) writeonly buffer Color { uint own_colors[]; };
#endif
layout(std430, binding = STORAGE_NORMAL) writeonly buffer Normal { float own_normals[]; };

// light, normal: means of what `look.glsl` gives; where nothing was added, the visible ones, of what is shown. coverage: of
// the pixel.
void store_mean(int index, vec3 light, vec3 normal, bool is_added, float coverage, vec3 visible_light, vec3 visible_normal) {
    normal = is_added ? normal : visible_normal;
#if HAS_COLORS
    light = is_added ? light : visible_light;
    own_colors[index] = packUnorm4x8(vec4(srgb_of_light(light), coverage));
#endif
    own_normals[3 * index] = normal.x;
    own_normals[3 * index + 1] = normal.y;
    own_normals[3 * index + 2] = normal.z;
}
