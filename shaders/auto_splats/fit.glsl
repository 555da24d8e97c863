// The plane through a neighborhood by linear regression (Preiner 2012, 6), and its splat.
#include "common/octahedron.glsl"
#include "common/tangent.glsl"
#include "auto_splats/eigen.glsl"

layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
#if HAS_COLORS
layout(binding = TEXTURE_COLORS) uniform samplerBuffer colors;
#endif
#if LAYERS
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer rows;
#endif
#if BY_SCANNER
layout(binding = TEXTURE_RANGE_VIEWS) uniform samplerBuffer range_views;  // its eye, and its first row
#endif
layout(std430, binding = STORAGE_SPLATS) writeonly buffer Splats { uint splats[]; };  // as amplify/packed.glsl reads
layout(std430, binding = STORAGE_EXTENTS) buffer Extents { float extents[]; };  // radii of neighborhoods, by row
layout(std430, binding = STORAGE_LOOKS) writeonly buffer Looks { uint looks[]; };  // as surfels/passes/look.glsl reads
layout(std430, binding = STORAGE_FOUND) writeonly buffer Found { vec4 found[]; };  // by place in the list

const float COLLINEAR = 1e-5;  // of the largest eigenvalue, below which the second makes no plane
const float LEAST_ROUND = 0.25;  // of the longer half-axis, what the shorter one is at least
const float LEAST = 1e-30;  // radius where all are in one place: none is drawn smaller than a pixel

#if ADAPTIVE
// How far residuals may let a normal turn, in radians: the root of their variance over the sum of squares
// along the narrower side of the neighborhood.
const float CERTAIN = 0.05;
const int LEAST_COUNT = 6;

// The least number of the nearest with which the plane is that certain, or with which it is most certain.
int count_of_plane(vec3 place, Extent extent) {
    float scale = extent.squared > 0.0 ? inversesqrt(extent.squared) : 0.0, least = UNKNOWN;
    vec3 sum = vec3(0.0), squares = vec3(0.0), products = vec3(0.0);
    int best = extent.count, tried = LEAST_COUNT;
    for (int k = 0; k < K; ++k) {
        int count = k + 1, row = count <= extent.count ? int(near_rows[k]) : 0;
        vec3 offset = (texelFetch(positions, row).xyz * unit - place) * scale;
        sum += offset;
        squares += offset * offset;
        products += offset.yzx * offset.zxy;
        if (count == tried) {
            tried += tried / 3;
            mat3 vectors;
            vec3 mean = sum / float(count);
            vec3 values = eigen(squares - sum * mean, products - sum.yzx * mean.zxy, vectors);
            bool is_plane = values.y > COLLINEAR * values.z;
            float turned = is_plane ? max(values.x, 0.0) / (float(count - 3) * values.y) : UNKNOWN;
            if (count <= extent.count && least > CERTAIN * CERTAIN && turned < least) {
                least = turned;
                best = count;
            }
        }
    }
    return best;
}
#endif

// Means are of offsets from the point, over the neighborhood's radius: small numbers, whatever the scan's
// place and size.
vec3 fit_plane(vec3 place, Extent extent, int count, out mat3 vectors) {
    float scale = extent.squared > 0.0 ? inversesqrt(extent.squared) : 0.0;
    vec3 offsets[K], mean = vec3(0.0);
    for (int k = 0; k < K; ++k) {
        bool counts = k < count;
        vec3 offset = (texelFetch(positions, counts ? int(near_rows[k]) : 0).xyz * unit - place) * scale;
        offsets[k] = counts ? offset : vec3(0.0);
        mean += offsets[k];
    }
    mean /= float(count);
    vec3 squares = vec3(0.0), products = vec3(0.0);
    for (int k = 0; k < K; ++k) {
        vec3 d = k < count ? offsets[k] - mean : vec3(0.0);
        squares += d * d;
        products += d.yzx * d.zxy;
    }
    return eigen(squares, products, vectors);
}

// What a normal of this place points to, along the pose's axes.
vec3 seen_from(uint row) {
    vec3 place = texelFetch(positions, int(row)).xyz;
#if BY_SCANNER
    vec3 scanner = vec3(0.0);
    for (int i = 0; i < SCANNERS; ++i) {
        vec4 view = texelFetch(range_views, i);
        if (row >= floatBitsToUint(view.w)) scanner = view.xyz;
    }
    return scanner - place;
#else
    return transpose(mat3(world_to_view)) * (view_perspective ? -to_view(place) : vec3(0.0, 0.0, 1.0));
#endif
}

// Which way a splat's longer half-axis lies, and how round it is, as amplify/packed.glsl has it.
uint pack_axes(vec3 normal, vec3 longer, float roundness) {
    vec3 u = tangent_of(normal), v = cross(normal, u);
    float angle = atan(dot(longer, v), dot(longer, u)) / 3.14159265;
    return packUnorm2x16(vec2(angle < 0.0 ? angle + 1.0 : angle, max(roundness, LEAST_ROUND)));
}

// How many of the nearest have splats, which alone have to close the surface: those that pixels show.
int shown_of(int count) {
#if LAYERS
    int shown = 0;
    for (int k = 0; k < K; ++k) {
        uint row = k < count ? near_rows[k] : near_rows[0];
        vec2 pixel;
        find_pixel(to_view(texelFetch(positions, int(row)).xyz), pixel);
        bool is_shown = in_picture(pixel) && texelFetch(rows, pixel_number(pixel)).r == row;
        shown += int(is_shown && k < count);
    }
    return max(shown, 1);
#else
    return count;
#endif
}

void fit(uint n, uint row, vec3 place, float usual_radius, Extent extent) {
    int count = extent.count;
#if ADAPTIVE
    count = count_of_plane(place, extent);
#endif
    mat3 vectors;
    vec3 values = max(fit_plane(place, extent, count, vectors), 0.0), to_eye = seen_from(row);
    vec3 normal = vectors[0];
    if (values.y <= COLLINEAR * values.z) {
        // Of points on a line, or one: what faces the eye most.
        vec3 along = values.z > 0.0 ? vectors[2] : vec3(0.0);
        normal = normalize(to_eye - dot(to_eye, along) * along);
    }
    if (dot(normal, to_eye) < 0.0) normal = -normal;
    bool is_outlier = is_alone(usual_radius * unit);
    float radius = sqrt(extent.squared) / unit, sum = values.x + values.y + values.z;
    float splat = max(2.0 * radius * inversesqrt(float(shown_of(extent.count))), LEAST);
    extents[row] = radius;
    splats[3u * row] = packSnorm2x16(folded(normal));
    splats[3u * row + 1u] = is_outlier && drops ? 0u : floatBitsToUint(splat);
    splats[3u * row + 2u] = pack_axes(normal, vectors[2], values.z > 0.0 ? values.y / values.z : 1.0);
#if HAS_COLORS
    looks[2u * row] = packUnorm4x8(vec4(texelFetch(colors, int(row)).rgb, 0.0));
#endif
    uvec3 steps = uvec3(roundEven(normal * 511.0 + 512.0));
    looks[2u * row + 1u] = steps.x | steps.y << 10 | steps.z << 20;
    found[n] = vec4(radius, is_outlier ? -extent.count : extent.count, sum > 0.0 ? values.x / sum : 0.0,
    usual_radius);
}
