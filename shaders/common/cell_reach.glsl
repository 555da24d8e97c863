// How far a point's cell reaches in its tangent plane, its Voronoi cell there: in direction w the least |d|^2 / (2 d.w)
// over the other points at d. In DIRECTIONS directions around, of which there are a multiple of eight.
const int PARTS = DIRECTIONS / 8;

// The least and the greatest d.w / |d|^2 in four directions each: one over twice how far it reaches, against w and along.
vec4 lowest[PARTS], highest[PARTS];

void clear_cell() {
    for (int part = 0; part < PARTS; ++part) lowest[part] = highest[part] = vec4(0.0);
}

// Whatever the order, and however often the same. at: d over |d|^2.
void bound_cell(vec2 at) {
    for (int part = 0; part < PARTS; ++part) {
        vec4 angle = (vec4(0.0, 1.0, 2.0, 3.0) + float(4 * part)) * (3.14159265 / float(4 * PARTS));
        vec4 along = at.x * cos(angle) + at.y * sin(angle);
        lowest[part] = min(lowest[part], along);
        highest[part] = max(highest[part], along);
    }
}
