// What the rows of a Surface have where they are samples of range views.
#include "common/view.glsl"
#include "range/samples.glsl"

// sRGB.
vec3 sample_color(uint row) {
    ivec4 at = sample_of_id(row, RANGE_COUNT);
    return sample_look(sample_index(range_view(at.x), 0, at.zw)).rgb;
}

// Along the pose's axes, of the plane through the samples around; zero where there is none.
vec3 normal_of_sample(uint row) {
    ivec4 at = sample_of_id(row, RANGE_COUNT);
    return transpose(mat3(world_to_view)) * sample_normal(range_view(at.x), 0, at.zw);
}
