// The cell of a point, where a disc around the point would reach too far (splatting/gaps.py writes it, surfels/gaps/fit.glsl
// packs it): the offset of the splat's middle, and up to three neighbours whose planes end the splat. Whole numbers below
// 2^24, which every feed keeps as they are.
const int CELL_PLANES = 3;
const float OFFSET_STEPS = 2047.0;  // of a half-axis, in 12 bits
const vec3 PLANE_STEPS = vec3(256.0 / 6.2831853, 127.0 / 3.14159265, 511.0 / 2.0);  // of direction, tilt, distance

// From the point to the splat's middle, in half-axes.
vec2 cell_offset(float word) {
    uint code = uint(word);
    return code == 0u ? vec2(0.0) : (vec2(code & 4095u, code >> 12) - (OFFSET_STEPS + 1.0)) / OFFSET_STEPS;
}

float packed_offset(vec2 offset) {
    uvec2 steps = uvec2(clamp(roundEven(offset * OFFSET_STEPS), -OFFSET_STEPS, OFFSET_STEPS) + (OFFSET_STEPS + 1.0));
    return float(steps.x | steps.y << 12);
}

// A neighbour's plane: where it crosses the splat's plane, as direction and distance from the point; and the angle between both
// planes' normals. Distances are in half-axes, the longer ones.
vec3 cell_plane(float word) {
    uint code = uint(word);
    return vec3(code & 255u, code >> 8 & 127u, code >> 15) / PLANE_STEPS;
}

// 0: no plane.
float packed_plane(float direction, float tilt, float distance) {
    uvec3 steps = uvec3(roundEven(vec3(direction, tilt, distance) * PLANE_STEPS));
    return float(steps.x & 255u | min(steps.y, 127u) << 8 | clamp(steps.z, 1u, 511u) << 15);
}
