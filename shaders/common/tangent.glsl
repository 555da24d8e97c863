// The direction in a plane from which angles are counted there, towards cross(n, it): a unit vector perpendicular to
// the plane's unit normal.
vec3 tangent_of(vec3 n) {
    precise vec3 u = cross(vec3(0.0, 1.0, 0.0), n);
    if (dot(u, u) < 1e-8) u = cross(vec3(0.0, 0.0, -1.0), n);  // n is parallel to (0, 1, 0)
    u = normalize(u);
    return u;
}
