// How far behind the visible splat others still count (Slomp 2014, V-B): visibility, pushed away from the eye.
#include "surfels/splat.glsl"
#include "amplify/radii.glsl"
#include "surfels/passes/layer.glsl"

// Of the splat that a pixel shows at this depth, scan units.
float visible_radius(float depth, uint row) {
    return splat_radius(stored_radius(int(row)), depth);
}

// The reversed depth-buffer value that splats must reach to count there.
float limit_behind(float depth, uint row) {
    precise float behind = depth + epsilon * visible_radius(depth, row);
    return stored_depth(behind);
}
