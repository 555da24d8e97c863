// Makes a splat of a point's cell where a disc would reach too far: an ellipse around the corners of the cell, whose middle
// need not be the point, and the planes of neighbours that end it. Lengths are in cells of the grid.
// LIMITED: where the nearest points lie on no plane, a small disc. The plain version is `plain` in
// tests/splatting/test_fitted.py.
#include "common/flat_reach.glsl"
#include "surfels/cell.glsl"

layout(std430, binding = STORAGE_CELL_AXES) writeonly buffer Axes { vec4 cell_axes[]; };
layout(std430, binding = STORAGE_CELLS) writeonly buffer Cells { vec4 cells[]; };

const int CORNERS = 16, SECTORS = 6, CORNER_PARTS = CORNERS / 8;
const float TURN = 6.2831853;

// lengths: of its half-axes. turn: of the longer one, from the first direction of the plane.
struct Ellipse { vec2 middle, lengths; float turn; };

// An ellipse round corners. rounds: of Khachiyan's method towards the smallest one.
Ellipse ellipse_round(vec2 corners[CORNERS], int rounds) {
    float weights[CORNERS], far[CORNERS];
    for (int k = 0; k < CORNERS; ++k) weights[k] = 1.0 / float(CORNERS);
    vec2 middle;
    vec3 form;  // xx, xy, yy
    float most;
    for (int i = 0; i <= rounds; ++i) {
        middle = vec2(0.0);
        form = vec3(0.0);
        most = 0.0;
        for (int k = 0; k < CORNERS; ++k) middle += weights[k] * corners[k];
        for (int k = 0; k < CORNERS; ++k) {
            vec2 off = corners[k] - middle;
            form += weights[k] * vec3(off.x * off.x, off.x * off.y, off.y * off.y);
        }
        float trace = form.x + form.z, divisor = max(form.x * form.z - form.y * form.y, 1e-12 * trace * trace);
        for (int k = 0; k < CORNERS; ++k) {
            vec2 off = corners[k] - middle;
            far[k] = (form.z * off.x * off.x - 2.0 * form.y * off.x * off.y + form.x * off.y * off.y) / divisor;
            most = max(most, far[k]);
            weights[k] *= (far[k] + 1.0) / 3.0;
        }
    }
    form *= most;
    float mean = 0.5 * (form.x + form.z), half_difference = 0.5 * (form.x - form.z);
    float spread = length(vec2(half_difference, form.y));
    vec2 squares = vec2(mean + spread, max(mean - spread, 0.0));
    float turn = spread > 0.0 ? 0.5 * atan(form.y, half_difference) : 0.0;
    return Ellipse(middle, sqrt(squares), turn);
}

vec2 turned_by(float angle) { return vec2(cos(angle), sin(angle)); }

// One over twice how far the cell reaches, against and along each of some directions, as in common/cell_reach.glsl.
vec4 corner_back[CORNER_PARTS], corner_forth[CORNER_PARTS];
// How far the neighbours around lie, against and along these: where none lies beyond, the surface bends away or ends.
vec4 spread_back[CORNER_PARTS], spread_forth[CORNER_PARTS];

// The corners of a cell that reaches so far forth and back in each of eight directions.
void corners_of(vec4 forth, vec4 back, out vec2 corners[CORNERS]) {
    for (int k = 0; k < CORNERS / 2; ++k) {
        int of = k / CORNER_PARTS;
        vec2 to = turned_by(TURN / 8.0 * float(of));
        corners[k] = forth[of] * to;
        corners[k + CORNERS / 2] = -back[of] * to;
    }
}

// Frame of the plane that the cell is looked at in again. Of each sector, the neighbour whose plane may cut off most, which its
// place alone tells as on an arc: Mesa runs through both sides of a branch, so that few normals are read. Then what their planes
// do cut off. Loops have constant bounds and no other way out, as Mesa keeps arrays in registers then.
Ellipse rough;
vec3 rough_u, rough_v;
float fit_radius;         // of the disc
float guess[SECTORS];     // how high the splat would rise over the plane
float guess_to[SECTORS];  // cosine of the direction, which tells equal ones apart
int guess_at[SECTORS];    // slot
float cut_off[SECTORS];   // as the guess
vec2 cut_to[SECTORS];     // direction, a unit vector
vec2 cut_by[SECTORS];     // tilt between both normals, distance

// forth, back: how far the cell counts in eight directions.
void begin_fit(vec4 forth, vec4 back, float radius, vec3 u, vec3 v) {
    vec2 corners[CORNERS];
    corners_of(forth, back, corners);
    rough = ellipse_round(corners, 0);
    rough.lengths.y = max(rough.lengths.y, rough.lengths.x / THINNEST);
    vec2 along = turned_by(rough.turn);
    rough_u = along.x * u + along.y * v;
    rough_v = along.x * v - along.y * u;
    rough.middle = vec2(dot(rough.middle, along), dot(rough.middle, vec2(-along.y, along.x)));
    fit_radius = radius;
    for (int k = 0; k < SECTORS; ++k) {
        guess[k] = 0.0;
        guess_to[k] = -2.0;
        guess_at[k] = 0;
    }
    for (int part = 0; part < CORNER_PARTS; ++part) {
        corner_back[part] = corner_forth[part] = vec4(0.0);
        spread_back[part] = spread_forth[part] = vec4(0.0);
    }
}

// A neighbour at d, in any order. at: its slot.
void take_neighbor(vec3 d, float squared, vec3 n, int at) {
    float below = -dot(d, n), scale = inversesqrt(max(squared, 1e-30));
    float rise = below * (2.0 * fit_radius * scale - 1.0);
    rise = squared <= NEAR * NEAR * fit_radius * fit_radius && below * scale > BELOW ? rise : 0.0;
    // Sectors of a sixth of a turn: the upper three, and the lower ones.
    vec2 to = vec2(dot(d, rough_u), dot(d, rough_v));
    to *= inversesqrt(max(dot(to, to), 1e-30));
    float x = to.y < 0.0 ? -to.x : to.x;
    int sector = (x > 0.5 ? 0 : x > -0.5 ? 1 : 2) + (to.y < 0.0 ? 3 : 0);
    for (int k = 0; k < SECTORS; ++k) {
        bool better = sector == k && (rise > guess[k] || (rise == guess[k] && rise > 0.0 && to.x > guess_to[k]));
        guess[k] = better ? rise : guess[k];
        guess_to[k] = better ? to.x : guess_to[k];
        guess_at[k] = better ? at : guess_at[k];
    }
}

// What the planes of the neighbours that were found cut off.
void find_cuts(vec3 place, vec3 n) {
    for (int k = 0; k < SECTORS; ++k) {
        vec4 slot = texelFetch(slots, guess_at[k]);
        vec3 d = (slot.xyz - place) / cell_size, other = texelFetch(normals, floatBitsToInt(slot.w)).xyz;
        float len = length(other);
        bool is_known = guess[k] > 0.0 && len > 0.0 && len < UNKNOWN;
        other = is_known ? other / len : n;
        float height = dot(d, other), tilt = clamp(dot(other, n), -1.0, 1.0), slope = sqrt(max(1.0 - tilt * tilt, 1e-6));
        vec2 to = vec2(dot(other, rough_u), dot(other, rough_v)) / slope;
        float room = height + SLACK * fit_radius;
        float cut = slope * (dot(rough.middle, to) + SPARE_FIT * length(rough.lengths * to)) - room;
        cut_off[k] = is_known && height >= 0.0 && cut > LEAST_CUT * fit_radius ? cut : 0.0;
        cut_to[k] = to;
        cut_by[k] = vec2(acos(tilt), room / slope);
    }
}

void take_corner(vec3 d, float squared) {
    vec2 at = vec2(dot(d, rough_u), dot(d, rough_v)) * rough.lengths;
    float inverse = 1.0 / max(squared, 1e-30), is_near = squared <= NEAR * NEAR * fit_radius * fit_radius ? 1.0 : 0.0;
    for (int part = 0; part < CORNER_PARTS; ++part) {
        vec4 angle = (vec4(0.0, 1.0, 2.0, 3.0) + float(4 * part)) * (TURN / float(CORNERS));
        vec4 along = at.x * cos(angle) + at.y * sin(angle);
        corner_back[part] = min(corner_back[part], inverse * along);
        corner_forth[part] = max(corner_forth[part], inverse * along);
        spread_back[part] = min(spread_back[part], is_near * along);
        spread_forth[part] = max(spread_forth[part], is_near * along);
    }
}

// The planes that cut off most, packed, the most first. turn: of the first half-axis from rough_u. longer: half-axis.
vec3 packed_planes(float turn, float longer) {
    vec3 words = vec3(0.0);
    for (int i = 0; i < CELL_PLANES; ++i) {
        float most = 0.0;
        vec2 to = vec2(1.0, 0.0), by = vec2(0.0);
        for (int k = 0; k < SECTORS; ++k) {
            bool better = cut_off[k] > most;
            most = better ? cut_off[k] : most;
            to = better ? cut_to[k] : to;
            by = better ? cut_by[k] : by;
        }
        for (int k = 0; k < SECTORS; ++k) cut_off[k] = cut_off[k] == most ? 0.0 : cut_off[k];
        float direction = fract((atan(to.y, to.x) - turn) / TURN) * TURN;
        float word = packed_plane(direction, by.x, by.y / longer);
        words[i] = most > 0.0 ? word : 0.0;
    }
    return words;
}

float limit = UNKNOWN;  // how far a splat may reach

#if LIMITED
vec3 close = vec3(UNKNOWN);  // squared distances of the nearest, ascending, no two the same
float lowest_height = 0.0, highest_height = 0.0;
vec4 least_along = vec4(0.0), most_along = vec4(0.0);  // in four directions of the tangent plane

// Whatever the order, and however often the same.
void take_close(float squared) {
    if (squared == 0.0 || squared == close.x || squared == close.y || squared >= close.z) return;
    if (squared < close.x) close = vec3(squared, close.xy);
    else close.yz = squared < close.y ? vec2(squared, close.y) : vec2(close.y, squared);
}

// Of points a little farther than the nearest: how far they lie along the normal and across.
void take_extent(vec3 d, float squared, vec3 n, vec3 u, vec3 v) {
    if (squared > AROUND_CLOSE * AROUND_CLOSE * close.z) return;
    float height = dot(d, n), x = dot(d, u), y = dot(d, v);
    lowest_height = min(lowest_height, height);
    highest_height = max(highest_height, height);
    vec4 along = vec4(x, y, 0.70710678 * (x + y), 0.70710678 * (x - y));
    least_along = min(least_along, along);
    most_along = max(most_along, along);
}

float limit_of_plane() {
    vec4 wide = 0.5 * (most_along - least_along);
    float narrow = min(min(wide.x, wide.y), min(wide.z, wide.w)), thick = max(highest_height - lowest_height, 1e-9);
    return flat_reach(BESIDE * sqrt(close.z), narrow, FLAT * (narrow / thick) * (narrow / thick));
}
#endif

// How far sides reach. One that does not end near the rough ellipse counts as little more than that, so that splats do
// not fill holes. inverse: one over twice how far they reach.
vec4 ended(vec4 inverse) {
    vec4 reaches = 0.5 / max(inverse, 1e-30);
    return mix(reaches, vec4(ENDLESS), greaterThan(reaches, vec4(OPEN)));
}

void store_fit(uint row, vec3 place, vec3 n) {
    find_cuts(place, n);
    vec2 corners[CORNERS];
    for (int part = 0; part < CORNER_PARTS; ++part) {
        vec4 forth = SPARE_FIT * ended(corner_forth[part]), back = SPARE_FIT * ended(-corner_back[part]);
        for (int k = 0; k < 4; ++k) {
            int i = 4 * part + k;
            vec2 to = rough.lengths * turned_by(TURN / float(CORNERS) * float(i));
            vec2 most = vec2(spread_forth[part][k], -spread_back[part][k]) / dot(to, to) + MARGIN * fit_radius / length(to);
            corners[i] = min(forth[k], most.x) * to;
            corners[i + CORNERS / 2] = -min(back[k], most.y) * to;
        }
    }
    Ellipse found = ellipse_round(corners, ROUNDS);
    float area = found.lengths.x * found.lengths.y, farthest = length(found.middle) + found.lengths.x;
    bool is_round = area > ROUND_SHARE * fit_radius * fit_radius && farthest < ROUND_FAR * fit_radius;
    if (is_round || limit < fit_radius) {
        cell_axes[row] = vec4(0.0);
        cells[row] = vec4(0.0, packed_planes(-rough.turn, min(fit_radius, limit)));
        return;
    }
    vec2 along = turned_by(found.turn);
    vec2 offset = vec2(dot(found.middle, along), dot(found.middle, vec2(-along.y, along.x)));
    cell_axes[row] = vec4(found.lengths.x * (along.x * rough_u + along.y * rough_v), found.lengths.y) * cell_size;
    cells[row] = vec4(packed_offset(offset / found.lengths), packed_planes(found.turn, found.lengths.x));
}
