// How far a splat may reach: at tips and on horns, points lie on no plane, and a splat that is wider than they are would
// stand out of the surface. beside: how far it must reach to those beside it. spread: of the points, along the narrower
// side. flatness: 1 or more where they lie on a plane.
float flat_reach(float beside, float spread, float flatness) { return max(beside, spread * max(flatness, 1.0)); }
