// The plane through a neighborhood by linear regression (Preiner 2012, 6), and its splat.
#include "common/cell_reach.glsl"
#include "common/color.glsl"
#include "common/flat_reach.glsl"
#include "auto_splats/eigen.glsl"
#include "auto_splats/splat.glsl"

#if HAS_COLORS
layout(binding = TEXTURE_COLORS) uniform samplerBuffer colors;
#endif
// By row: the radius of the neighborhood; how far the mean of its points lies above the point, 0 without a plane; and how
// far the middle of the splat lies from the point, along the shorter half-axis.
layout(std430, binding = STORAGE_EXTENTS) buffer Extents { float extents[]; };
layout(std430, binding = STORAGE_FOUND) writeonly buffer Found { vec4 found[]; };  // by place in the list

const int LEAST_COUNT = 6;  // points that tell of a surface
// Radii in the picture's typical ones: from which neighbors are far; from which on splats grow no more: of those in
// space, not beyond `widest`.
const float FAR = 3.0;
const float MOST = 3.0;
const float COLLINEAR = 1e-5;  // of the largest eigenvalue, below which the second makes no plane
const float OPEN = 1.75;    // radii by share: a cell that reaches farther has no end there
const float LEAST_SHARE = 0.9, MOST_SHARE = 1.39;  // of the radius by share, bounds of that by the cell
const float FLAT = 0.38;  // of the second eigenvalue, up to which the least one is that of a plane
const float NOISY = 2.0; // of the variance of noise, what a plane has of it at most
const int CLOSE = 3;     // the neighbor that a splat reaches halfway to where there is no plane
const float CROWDED = 4.0;  // pixels within which hidden neighbors are as good as in one pixel
// Of the largest eigenvalue, below which the second is that of points on a line; radii that lines beside are within.
const float LINE = 0.1, BESIDE = 6.0;
const float LEAST = 1e-30;  // radius where all are in one place: none is drawn smaller than a pixel

// From the point, over the neighborhood's radius: small numbers, whatever the scan's place and size.
vec3 near_offsets[K];

void take_offsets(vec3 place, Extent extent) {
    float scale = extent.squared > 0.0 ? inversesqrt(extent.squared) : 0.0;
    for (int k = 0; k < K; ++k) {
        int row = k < extent.count ? int(near_rows[k] >> 1) : 0;
        near_offsets[k] = (texelFetch(positions, row).xyz * unit - place) * scale;
    }
}

#if ADAPTIVE
// A plane is told by as few of the nearest as tell it for certain: their residuals let its normal turn by no more
// than this, the root of their variance over the sum of squares along the narrower side; and some more turn it by no
// more.
const float CERTAIN = 0.08;        // radians
const float MOST_TURNED = 0.9781;  // cosine of 12 degrees

int count_of_plane(Extent extent) {
    vec3 normal = vec3(0.0);
    int best = 0, before = 0;  // before: how many tell the plane that is compared, 0: none
    for (int count = LEAST_COUNT; count <= extent.count && best == 0; count += count / 3) {
        vec3 sum = vec3(0.0), squares = vec3(0.0), products = vec3(0.0);
        for (int k = 0; k < K; ++k) {
            vec3 offset = k < count ? near_offsets[k] : vec3(0.0);
            sum += offset;
            squares += offset * offset;
            products += offset.yzx * offset.zxy;
        }
        mat3 vectors;
        vec3 mean = sum / float(count);
        vec3 values = eigen(squares - sum * mean, products - sum.yzx * mean.zxy, vectors);
        if (before > 0 && abs(dot(normal, vectors[0])) >= MOST_TURNED) best = before;
        float turned = max(values.x, 0.0) / float(count - 3);
        bool is_certain = values.y > COLLINEAR * values.z && turned <= CERTAIN * CERTAIN * values.y;
        before = is_certain ? count : 0;
        normal = vectors[0];
    }
    return best > 0 ? best : extent.count;
}
#endif

vec3 fit_plane(int count, out mat3 vectors, out vec3 mean) {
    mean = vec3(0.0);
    for (int k = 0; k < K; ++k) mean += k < count ? near_offsets[k] : vec3(0.0);
    mean /= float(count);
    vec3 squares = vec3(0.0), products = vec3(0.0);
    for (int k = 0; k < K; ++k) {
        vec3 d = k < count ? near_offsets[k] - mean : vec3(0.0);
        squares += d * d;
        products += d.yzx * d.zxy;
    }
    return eigen(squares, products, vectors);
}

// Whether the point is an outlier: without another one within `alone` times the usual radius; or where neighbors are
// far, with all of them about as far as the farthest, which those of a point of a surface are not.
bool is_outlier(Extent extent, float usual_radius, bool sparse) {
    float limit = usual_radius * unit * alone;
    bool apart = alone < UNKNOWN && sparse && extent.count >= LEAST_COUNT && near_squared[1] > 0.7 * extent.squared;
    return near_squared[1] > limit * limit || apart;
}

// The radius that closes a cell in four directions. bounds: one over twice how far it reaches.
vec4 closing(vec4 bounds, float share) {
    vec4 reach = 0.5 / max(bounds, 1e-9);
    vec4 closed = min(LEANING * reach, vec4(MOST_SHARE * share));
    return mix(closed, vec4(share), greaterThan(reach, vec4(OPEN * share)));
}

// In radii of the neighborhood. Noise makes no tip.
float reach_of_plane(Extent extent, vec3 values, int count, float scale) {
    float blur = noise * unit * scale, thickness = values.x - NOISY * blur * blur * float(count);
    float spread = sqrt(2.0 * values.y / float(count)), flatness = FLAT * values.y / max(thickness, 1e-9);
    float close = 0.0;  // by no index that compilers do not know, as the array would go to memory
    for (int k = 1; k <= CLOSE; ++k) close = k < extent.count ? near_squared[k] : close;
    return flat_reach(0.5 * LEANING * scale * sqrt(close), spread, flatness);
}

// The radius of a splat: how far the places reach that are nearer to the point than to any other one, its Voronoi cell in
// the plane, so that splats leave no gap however uneven points lie; where the cell is open, as at borders, and at least about
// as a point's share of the surface. Hidden neighbors have no splats: near ones, where points crowd the pixels, have no cell
// either. count: points that tell the plane. crowded: how near hidden ones are. most: that a neighborhood counts for,
// as discs of the few points of sparse parts would hide the rest.
float splat_radius(Extent extent, int count, vec3 values, vec3 normal, float crowded, float most) {
    float scale = extent.squared > 0.0 ? inversesqrt(extent.squared) : 0.0, radius = min(sqrt(extent.squared), most);
    if (values.y <= COLLINEAR * values.z) return 2.0 * radius * inversesqrt(float(extent.count));
    // Directions turn with the scan: they are counted from the nearest neighbor's.
    vec3 beside = near_offsets[1] - dot(near_offsets[1], normal) * normal;
    vec3 u = dot(beside, beside) > 1e-12 ? normalize(beside) : tangent_of(normal), v = cross(normal, u);
    clear_cell();
    int seen = 1;
    for (int k = 1; k < K; ++k) {
        bool counts = k < extent.count && ((near_rows[k] & 1u) == 0u || near_squared[k] > crowded * crowded);
        vec2 at = vec2(dot(near_offsets[k], u), dot(near_offsets[k], v));
        float squared = dot(at, at);
        bound_cell(counts && squared > 0.0 ? at / squared : vec2(0.0));
        seen += int(counts);
    }
    float share = 2.0 * inversesqrt(float(seen)), reach = LEAST_SHARE * share;
    for (int part = 0; part < PARTS; ++part) {
        vec4 four = max(closing(highest[part], share), closing(-lowest[part], share));
        reach = max(reach, max(max(four.x, four.y), max(four.z, four.w)));
    }
    return radius * min(reach, reach_of_plane(extent, values, count, scale));
}

#if CUT
const int SIDES = 12;
const float MARGIN = 0.8;  // of a splat's radius, what it reaches beyond all neighbors
const float LEAST_FACING = 0.05;  // cosine between a normal and the line of sight, what it counts as at least

vec2 side_of(int i) {
    float angle = 6.2831853 / float(SIDES) * float(i);
    return vec2(cos(angle), sin(angle));
}

// Programs that search and those that take neighbors that are kept find the same ends, with `precise`.

// The side to which neighbors reach least, as seen from the eye, and how far they do: where a surface turns away sharply
// or ends, none lies beyond. A unit vector of the plane, and a distance in radii of the neighborhood.
vec4 narrowest(Extent extent, vec3 normal, vec3 to_eye) {
    precise float facing = max(dot(normal, to_eye), LEAST_FACING);
    precise vec3 u = tangent_of(normal), v = cross(normal, u);
    precise float reaches[SIDES];
    for (int i = 0; i < SIDES; ++i) reaches[i] = 0.0;
    for (int k = 1; k < K; ++k) {
        precise vec3 d = k < extent.count ? near_offsets[k] : vec3(0.0);
        d -= dot(d, normal) / facing * to_eye;
        precise vec2 at = vec2(dot(d, u), dot(d, v));
        for (int i = 0; i < SIDES; ++i) reaches[i] = max(reaches[i], dot(at, side_of(i)));
    }
    precise vec4 found = vec4(0.0, 0.0, 0.0, UNKNOWN);
    for (int i = 0; i < SIDES; ++i) {
        vec2 side = side_of(i);
        if (reaches[i] < found.w) found = vec4(side.x * u + side.y * v, reaches[i]);
    }
    return found;
}
#endif

#if BENDS
const float RIDGE = 0.02;  // of the sum of fourth powers: few neighbors tell no bend
const float LEAST_SLANT = 1e-3, LEAST_BEND = 1e-6;  // below, no outline is near

// Where the picture of the surface ends on a splat's plane, if heights of neighbors are those of a paraboloid: its normal is
// perpendicular to the line of sight along a line, and seen from the eye, this line lies on the plane half as far from the
// point. height: of the splat over the point. Returned as `narrowest` does.
vec4 outline(Extent extent, vec3 normal, vec3 to_eye, float height) {
    precise float facing = dot(normal, to_eye);
    precise vec3 along = to_eye - facing * normal, by = vec3(0.0);
    precise float slant = max(length(along), LEAST_SLANT), far = facing / slant;
    along /= slant;
    precise vec3 across = cross(normal, along);
    precise mat3 form = mat3(0.0);
    for (int k = 1; k < K; ++k) {
        precise vec3 d = k < extent.count ? near_offsets[k] : vec3(0.0);
        precise vec2 at = vec2(dot(d, along), dot(d, across));
        precise float rise = dot(d, normal), weight = rise * rise <= dot(at, at) ? 1.0 : 0.0;  // else on another side of it
        precise vec3 terms = weight * vec3(0.5 * at.x * at.x, at.x * at.y, 0.5 * at.y * at.y);
        form += outerProduct(terms, terms);
        by += rise * terms;
    }
    precise float ridge = RIDGE * (form[0][0] + form[1][1] + form[2][2]) + 1e-12;
    precise vec2 bend = (inverse(form + mat3(ridge)) * by).xy;
    precise float steep = max(length(bend), LEAST_BEND), end = 0.5 * far + bend.x * height / max(far, LEAST_SLANT);
    return vec4((bend.x * along + bend.y * across) / steep, max(end, 0.0) / steep);
}
#endif

// Returns how far lines beside it are looked for where all neighbors are on a line, scan units; else 0.
float fit(uint n, uint row, vec3 place, float usual_radius, Extent extent) {
    int count = extent.count;
    take_offsets(place, extent);
#if ADAPTIVE
    count = count_of_plane(extent);
#endif
    mat3 vectors;
    vec3 mean, values = max(fit_plane(count, vectors, mean), 0.0), to_eye = seen_from(row);
    vec3 normal = vectors[0];
    if (values.y <= COLLINEAR * values.z) {
        // Of points on a line, or one: what faces the eye most.
        vec3 along = values.z > 0.0 ? vectors[2] : vec3(0.0);
        normal = normalize(to_eye - dot(to_eye, along) * along);
    }
    if (dot(normal, to_eye) < 0.0) normal = -normal;
    float radius = sqrt(extent.squared) / unit, sum = values.x + values.y + values.z;
    float pixel = 1.0 / scale_at(-to_view(texelFetch(positions, int(row)).xyz).z), in_picture = typical * pixel;
    float typical_radius = max(in_picture, typical_in_space);  // near the eye, points are sparse in any picture
    float most = min(MOST * typical_radius, max(widest, MOST * in_picture));
    float splat = splat_radius(extent, count, values, normal, CROWDED * pixel * unit, most * unit) / unit;
    bool outlier = is_outlier(extent, usual_radius, radius > FAR * typical_radius);
    bool on_line = extent.count >= LEAST_COUNT && values.y < LINE * values.z;
    bool has_plane = values.y > COLLINEAR * values.z && !outlier && !on_line;
    precise float height = has_plane ? dot(mean, normal) : 0.0, shift = 0.0;
    vec3 longer = vectors[2];
    float roundness = ELLIPTICAL && values.z > 0.0 ? values.y / values.z : 1.0;
#if CUT
    precise vec3 sight = normalize(to_eye);
    precise vec4 end = narrowest(extent, normal, sight);
    end.w = end.w * radius + MARGIN * splat;
#if BENDS
    vec4 bent = outline(extent, normal, sight, height);
    if (bent.w * radius < end.w) end = vec4(bent.xyz, bent.w * radius);
#endif
    if (has_plane && end.w < splat) shift = cut(normal, end.xyz, end.w, pixel, splat, longer, roundness);
#endif
    extents[3u * row] = radius;
    extents[3u * row + 1u] = height * radius;
    extents[3u * row + 2u] = shift;
    splats[3u * row] = packSnorm2x16(folded(normal));
    splats[3u * row + 1u] = outlier && drops ? 0u : floatBitsToUint(max(splat, LEAST));
    splats[3u * row + 2u] = pack_axes(normal, longer, roundness);
#if HAS_COLORS
    uvec3 roots = uvec3(to_roots(texelFetch(colors, int(row)).rgb));
    looks[2u * row] = roots.x | roots.y << 10 | roots.z << 20;
#endif
    looks[2u * row + 1u] = pack_normal(normal);
    found[n] = vec4(radius, outlier ? -extent.count : extent.count,
                    sum > 0.0 ? values.x / sum : 0.0, usual_radius);
    return on_line && !(outlier && drops) ? BESIDE * min(radius, most) : 0.0;
}
