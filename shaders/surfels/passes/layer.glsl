// The layer of splats that a pixel shows: the nearest one, and those that noise puts in front of it and behind it. Depths
// are added up as whole numbers, like what look.glsl gives: as steps from the nearest splat's key to the back of the layer.
#ifndef LOCAL
#define LOCAL 0  // whether a pixel shows the mean depth of its layer, else the depth of the nearest splat
#endif

#if LOCAL
const float LAYER_STEPS = 8191.0;

// How thick the layer is along the view axis, scan units. normal: of the nearest splat, of any length; 0: unknown.
float layer_depth(vec3 normal, vec2 pixel) {
    precise vec3 ray = view_perspective ? from_pixel(pixel, 1.0) : vec3(0.0, 0.0, -1.0);
    precise float len = length(normal), facing = abs(dot(mat3(world_to_view) * normal, ray));
    precise float thick = layer * (len > 0.0 ? min(len / max(facing, 1e-6 * len), LAYER_SLOPE) : 1.0);
    return thick;
}

// Steps of the layer for a difference of keys. front: key of the nearest splat; depth: its depth.
float steps_per_key(float front, float depth, vec3 normal, vec2 pixel) {
    precise float back = depth + layer_depth(normal, pixel);
    precise float steps = LAYER_STEPS / max(front - stored_depth(back), 1e-30);
    return steps;
}

// Steps from the nearest splat to another one; 0 where that one is of another layer.
float layer_steps(float front, float key, float per_key) {
    precise float steps = (front - key) * per_key;
    return abs(steps) > LAYER_STEPS ? 0.0 : roundEven(steps);
}

// The depth of so many steps behind the nearest splat.
float depth_of_steps(float front, float steps, float per_key) {
    precise float key = front - steps / per_key;
    return linear_depth(key);
}
#endif
