// Voxels of space, by a table: several may share a place in it, so that a point's own voxel is compared.
layout(binding = TEXTURE_POSITIONS) uniform samplerBuffer positions;
uniform float per_voxel;  // voxels a scan unit
uniform uint table_mask;

// In voxels. `precise`: a product that is contracted with a difference would leave a rest between equal points.
vec3 point_at(uint row) {
    precise vec3 point = per_voxel * texelFetch(positions, int(row)).xyz;
    return point;
}

ivec3 voxel_of(vec3 point) { return ivec3(floor(clamp(point, -1e9, 1e9))); }

uint place_of(ivec3 voxel) {
    uvec3 mixed = uvec3(voxel) * uvec3(0x9E3779B1u, 0x85EBCA77u, 0xC2B2AE3Du);
    uint hash = (mixed.x ^ mixed.y ^ mixed.z) * 0x27D4EB2Fu;
    return (hash ^ hash >> 15) & table_mask;
}
