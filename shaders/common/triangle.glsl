// A triangle in the picture, by the pixel coordinates and the depths of its corners; needs common/view.glsl.

// Twice the area to one side of an edge, from the corner that comes first, so that triangles that share it agree.
float beside(vec2 from, vec2 to, vec2 pixel) {
    precise vec2 edge = to - from, away = pixel - from;
    precise float area = edge.x * away.y - edge.y * away.x;
    return area;
}

// Shares of the corners at a pixel, not divided by their sum; all of one sign inside.
vec3 shares_at(vec2 x, vec2 y, vec2 z, vec2 pixel) {
    return vec3(beside(y, z, pixel), -beside(x, z, pixel), beside(x, y, pixel));
}

bool is_inside(vec3 shares) {
    return all(greaterThanEqual(shares, vec3(0.0))) || all(lessThanEqual(shares, vec3(0.0)));
}

// The depth of the triangle's plane at a pixel, between those of its corners.
float depth_at(vec3 depths, vec3 shares) {
    precise vec3 inverse = view_perspective ? 1.0 / depths : vec3(1.0);
    precise float sum = shares.x + shares.y + shares.z;
    precise float depth = view_perspective
        ? sum / (shares.x * inverse.x + shares.y * inverse.y + shares.z * inverse.z)
        : (shares.x * depths.x + shares.y * depths.y + shares.z * depths.z) / sum;
    float low = min(depths.x, min(depths.y, depths.z)), high = max(depths.x, max(depths.y, depths.z));
    return sum == 0.0 ? low : clamp(depth, low, high);
}

// Shares in space, of sum 1; all the first corner's where the triangle is seen from its edge.
vec3 shares_in_space(vec3 depths, vec3 shares) {
    if (view_perspective) shares /= depths;
    float sum = shares.x + shares.y + shares.z;
    return sum == 0.0 ? vec3(1.0, 0.0, 0.0) : shares / sum;
}
