// Elements of code words: points as a view shows them, in steps of the table (viewer/codewords/project_kernels.py, `project`
// and `_quantise`, in float32). MATERIALS: points have one of their own.
#include "common/item.glsl"
#include "surfels/splat.glsl"
#include "amplify/texels.glsl"
#include "codeword/element.glsl"

#if MATERIALS
layout(binding = TEXTURE_MATERIALS) uniform usamplerBuffer point_materials;  // of rows
#endif
layout(std430, binding = STORAGE_ELEMENTS) writeonly buffer Elements { uvec4 elements[]; };
layout(std430, binding = STORAGE_HEADS) writeonly buffer Heads { uint heads[]; };
layout(std430, binding = STORAGE_SPREAD) buffer Spread { uint least, most, largest; };  // depths, as ordered numbers; size

const float FARTHEST = 1e6;   // pixels: what is centred farther away is left out
const float FLATTEST = 1e-6;  // of |n_z|: a disc that is seen more edge on shows nothing
const float SHADES = 127.0;   // indices of light

shared uint nearest, farthest, longest;

vec3 n, eye;  // towards the eye, both

// Size and normal, in steps, of the disc whose image is the ellipse of the half-axes a and b, pixels right and down.
void quantise(vec2 a, vec2 b, out float size, out vec2 normal) {
    precise float unit = max(max(max(abs(a.x), abs(a.y)), max(abs(b.x), abs(b.y))), 1e-30);
    a /= unit;
    b /= unit;
    precise float xx = a.x * a.x + b.x * b.x, xy = a.x * a.y + b.x * b.y, yy = a.y * a.y + b.y * b.y;
    precise float area = a.x * b.y - a.y * b.x, apart = sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy);
    float major = 0.5 * (xx + yy) + apart, minor = max(area * area / major, major * 1e-12);  // squared half-axes
    float slope = sqrt(2.0 * apart / minor);
    float turned = apart > 0.0 ? clamp(0.5 * (xx - yy) / apart, -1.0, 1.0) : 1.0;
    vec2 along = sqrt(0.5 * vec2(1.0 - turned, 1.0 + turned));  // of the shorter half-axis
    normal = slope * normal_parts * vec2(along.x, xy > 0.0 ? -along.y : along.y);
    float beyond = max(abs(normal.x), abs(normal.y)) / max(float(steepest), 0.5);
    if (beyond > 1.0) normal /= beyond;
    normal = steepest == 0 ? vec2(0.0) : roundEven(normal);
    float smallest = ceil(LEAST_RADIUS * size_parts);  // of which the four pixels round the centre are in
    size = max(min(roundEven(sqrt(major) * unit * size_parts), MOST_SIZE), smallest);
}

// Diffuse and specular index by Phong, as shade/shade.comp has them.
uint shade() {
    if (!is_lit) return uint(SHADES);
    vec3 towards = from_eye ? eye : light.xyz;
    float facing = dot(n, towards), highlight = 0.0;
    if (facing > 0.0) highlight = pow(max(2.0 * facing * dot(n, eye) - dot(towards, eye), 0.0), light.w);
    uvec2 index = uvec2(roundEven(SHADES * clamp(vec2(facing, highlight), 0.0, 1.0)));
    return index.x | index.y << 7;
}

// All 0 where it shows nothing.
uvec4 project(Point point) {
    vec3 center = to_view(point.position);
    float depth = -center.z;
    if (!in_depth_range(depth)) return uvec4(0u);
    vec2 pixel = to_pixel(center);
    if (!(max(abs(pixel.x), abs(pixel.y)) < FARTHEST)) return uvec4(0u);

    vec3 to_eye = towards_eye(center), own = splat_normal(point, to_eye), u, v;
    eye = normalize(to_eye);
    n = mat3(world_to_view) * own;
    float facing = dot(n, eye);
    if (cull_back && facing <= 0.0) return uvec4(0u);
    if (facing < 0.0) n = -n;
    if (abs(facing) <= FLATTEST) return uvec4(0u);

    vec2 lengths = splat_axes(point, own, depth, u, v) * scale_at(depth);
    u = mat3(world_to_view) * u;
    v = mat3(world_to_view) * v;
    vec2 tilt = view_perspective ? center.xy / depth : vec2(0.0);
    vec2 a = lengths.x * (u.xy + tilt * u.z) * vec2(1.0, -1.0), b = lengths.y * (v.xy + tilt * v.z) * vec2(1.0, -1.0);
    vec2 reach = vec2(length(vec2(a.x, b.x)), length(vec2(a.y, b.y))) + 1.0;
    if (any(lessThan(pixel, -reach)) || any(greaterThan(pixel, vec2(view_size) + reach))) return uvec4(0u);

    float size;
    vec2 normal;
    quantise(a, b, size, normal);
    return packed_element(ivec2(roundEven(pixel)), uint(size), ivec2(normal), depth);
}

void main() {
    if (gl_LocalInvocationID.x == 0u) {
        nearest = NOTHING;
        farthest = longest = 0u;
    }
    memoryBarrierShared();
    barrier();
    uint i = item();
    if (i < item_count) {
        int row = drawn_row(int(i));
        uvec4 element = project(texel_point(row));
        elements[i] = element;
        if (element.z != 0u) {
            uint head = shade();
#if MATERIALS
            head |= texelFetch(point_materials, row).r << 14;
#endif
            heads[row] = head;
            uint order = ordered(element.w);
            atomicMin(nearest, order);
            atomicMax(farthest, order);
            atomicMax(longest, element.z);
        }
    }
    memoryBarrierShared();
    barrier();
    if (gl_LocalInvocationID.x == 0u && nearest <= farthest) {
        atomicMin(least, nearest);
        atomicMax(most, farthest);
        atomicMax(largest, longest);
    }
}
