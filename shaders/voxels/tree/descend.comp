// Which nodes of an octree a view shows, level after level (Slomp 2014, VI-B): what viewer/scan/octree/cut_kernels.py does, to
// the bit and in the same order. Nodes of a level are listed in the order in which they are drawn, each with what becomes of it:
// it is left out, shown, or divided.
// STEP 0: lists the root. 1, of one work group: adds up what becomes of the nodes of a level, block by block. 2: lists those that
// are shown, and the children of those that are divided, those nearest to the eye first.
#include "common/item.glsl"
#include "voxels/tree/node.glsl"
#include "voxels/tree/sight.glsl"

layout(binding = TEXTURE_NODE_MASKS) uniform usamplerBuffer node_masks;
layout(binding = TEXTURE_FIRST_CHILDREN) uniform usamplerBuffer first_children;
layout(binding = TEXTURE_NODE_CELLS) uniform usamplerBuffer node_cells;
#if CONES
layout(binding = TEXTURE_NORMALS) uniform samplerBuffer node_normals;
layout(binding = TEXTURE_CONES) uniform samplerBuffer node_cones;
#endif
layout(std430, binding = STORAGE_NODES) readonly buffer Nodes { uvec2 nodes[]; };  // which of the level, and bits below
layout(std430, binding = STORAGE_CHILDREN) writeonly buffer Children { uvec2 children[]; };
layout(std430, binding = STORAGE_SHOWN_NODES) writeonly buffer ShownNodes { uint shown_nodes[]; };  // of a level from its start on
layout(std430, binding = STORAGE_BLOCK_COUNTS) buffer BlockCounts { uint block_counts[]; };  // children, and shown << 16
layout(std430, binding = STORAGE_BLOCK_STARTS) buffer BlockStarts { uvec2 block_starts[]; };

uniform uint level;

// Bits of a listed node: how many children are listed, whether it is shown, whether it lies within all planes, which child is
// nearest to the eye.
const uint COUNT = 15u, SHOWN = 16u, WITHIN = 32u, NEAREST = 8u;

// Children, and shown << 16.
uint counts_of(uint bits) { return (bits & COUNT) | (bits & SHOWN) << 12; }

#if CONES
// Whether no position of the node's sphere with a normal in its cone faces the eye, as cut_kernels.py has it.
bool faces_away(uint node, dvec3 to_eye, double radius) {
    double cosine = texelFetch(node_cones, int(node)).r;
    dvec3 normal = texelFetch(node_normals, int(node)).xyz;
    if (cosine <= 0.0LF) return false;
    precise double sine = sqrt(1.0LF - cosine * cosine);
    if (is_perspective == 0u) {
        precise double along = normal.x * back[0] + normal.y * back[1] + normal.z * back[2];
        return along < -sine;
    }
    precise double towards = normal.x * to_eye.x + normal.y * to_eye.y + normal.z * to_eye.z;
    precise double squared = to_eye.x * to_eye.x + to_eye.y * to_eye.y + to_eye.z * to_eye.z - radius * radius;
    if (towards >= 0.0LF || squared <= 0.0LF) return false;
    precise double reach = sqrt(squared);
    precise double one = cosine * reach, other = sine * radius, limit = sine * reach + cosine * radius;
    return one > other && towards < -limit;
}
#endif

// What becomes of a node. within: whether its parent lies within all planes.
uint fate_of(uint index, uint at, bool within) {
    Level of = levels[at];
    uint node = of.start + index;
    precise dvec3 middle = middle_of(cell_of(texelFetch(node_cells, int(node)).xy), of.edge);
    precise double radius = HALF_DIAGONAL * of.edge, reach = radius + of.margin;
    if (!within) {
        precise double nearest = 1e300LF;
        for (uint p = 0u; p < 4u * plane_count; p += 4u) {
            precise double off = planes[p] * middle.x + planes[p + 1u] * middle.y + planes[p + 2u] * middle.z + planes[p + 3u];
            nearest = min(nearest, off);
        }
        precise double beyond = -radius - of.margin;
        if (nearest < beyond) {
            atomicAdd(outside, 1u);
            return 0u;
        }
        within = nearest >= reach;
    }
    precise dvec3 to_eye = dvec3(eye[0], eye[1], eye[2]) - middle;
#if CONES
    if (faces_away(node, to_eye, radius)) {
        atomicAdd(facing_away, 1u);
        return 0u;
    }
#endif
    uint mask = of.last != 0u ? 0u : texelFetch(node_masks, int(node)).r;
    bool small = mask == 0u;
    if (of.least > 0.0LF && !small) {
        precise double depth = 1.0LF;
        if (is_perspective != 0u) {
            depth = back[0] * to_eye.x + back[1] * to_eye.y + back[2] * to_eye.z;
            depth = depth - radius;
        }
        precise double size = view_pixels * of.edge, limit = of.least * max(depth, nearest_depth);
        small = size < limit;
    }
    if (small) return SHOWN;
    dvec3 towards = is_perspective != 0u ? to_eye : dvec3(back[0], back[1], back[2]);
    uint nearest_child = uint(towards.x >= 0.0LF) | uint(towards.y >= 0.0LF) << 1 | uint(towards.z >= 0.0LF) << 2;
    return uint(bitCount(mask)) | (within ? WITHIN : 0u) | nearest_child << NEAREST;
}

#if STEP == 0
void main() {
    if (item() > 0u) return;
    uint bits = fate_of(0u, 0u, false);
    children[0] = uvec2(0u, bits);
    block_counts[0] = counts_of(bits);
    next_count = 1u;
}
#elif STEP == 1
shared uvec2 sums[GROUP];

void main() {
    uint me = gl_LocalInvocationID.x, blocks = (next_count + uint(GROUP) - 1u) / uint(GROUP);
    uint run = (blocks + uint(GROUP) - 1u) / uint(GROUP), first = min(me * run, blocks), last = min(first + run, blocks);
    uvec2 sum = uvec2(0u);
    for (uint i = first; i < last; ++i) sum += uvec2(block_counts[i] & 0xFFFFu, block_counts[i] >> 16);
    sums[me] = sum;
    memoryBarrierShared();
    barrier();
    for (uint step = 1u; step < uint(GROUP); step *= 2u) {
        uvec2 before = me >= step ? sums[me - step] : uvec2(0u);
        memoryBarrierShared();
        barrier();
        sums[me] += before;
        memoryBarrierShared();
        barrier();
    }
    uvec2 before = sums[me] - sum, all = sums[GROUP - 1];
    for (uint i = first; i < last; ++i) {
        block_starts[i] = before;
        before += uvec2(block_counts[i] & 0xFFFFu, block_counts[i] >> 16);
    }
    memoryBarrierBuffer();
    barrier();
    for (uint i = me; i * uint(GROUP) < all.x; i += uint(GROUP)) block_counts[i] = 0u;
    if (me > 0u) return;
    count = next_count;
    groups_y = (blocks + uint(GROUP_LIMIT) - 1u) / uint(GROUP_LIMIT);
    groups_x = groups_y == 0u ? 0u : (blocks + groups_y - 1u) / groups_y;
    groups_z = 1u;
    next_count = all.x;
    shown[level] = all.y;
}
#else
shared uint sums[GROUP];

void main() {
    uint i = item(), me = gl_LocalInvocationID.x, block = i / uint(GROUP);
    uvec2 node = i < count ? nodes[i] : uvec2(0u);
    uint counted = counts_of(node.y);
    sums[me] = counted;
    memoryBarrierShared();
    barrier();
    for (uint step = 1u; step < uint(GROUP); step *= 2u) {
        uint before = me >= step ? sums[me - step] : 0u;
        memoryBarrierShared();
        barrier();
        sums[me] += before;
        memoryBarrierShared();
        barrier();
    }
    if (counted == 0u) return;
    uint before = sums[me] - counted, number = levels[level].start + node.x;
    uvec2 slots = block_starts[block] + uvec2(before & 0xFFFFu, before >> 16);
    if ((node.y & SHOWN) != 0u) {
        shown_nodes[levels[level].start + slots.y] = number;
        return;
    }
    uint mask = texelFetch(node_masks, int(number)).r, first = texelFetch(first_children, int(number)).r;
    uint nearest = node.y >> NEAREST, slot = slots.x;
    for (uint turn = 0u; turn < 8u; ++turn) {
        uint octant = turn ^ nearest;
        if ((mask >> octant & 1u) == 0u) continue;
        uint index = first + uint(bitCount(mask & ((1u << octant) - 1u)));
        uint bits = fate_of(index, level + 1u, (node.y & WITHIN) != 0u);
        children[slot] = uvec2(index, bits);
        if (bits != 0u) atomicAdd(block_counts[slot / uint(GROUP)], counts_of(bits));
        ++slot;
    }
}
#endif
