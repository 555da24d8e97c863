// The disc of each entry in the order of its cells: where it is seen on its face, how far it is and reaches; below 0 on
// faces that are not its own. Those that reach more than WINDOW cells tell the blocks of cells that they reach.
#include "common/item.glsl"
#include "common/list.glsl"
#include "hpr/windows.glsl"

uniform float sparser;
layout(binding = TEXTURE_LISTED) uniform usamplerBuffer listed;
layout(binding = TEXTURE_SPACINGS) uniform samplerBuffer spacings;
layout(std430, binding = STORAGE_SIGHTS) writeonly buffer Discs { vec4 discs[]; };
layout(std430, binding = STORAGE_WINDOWS) buffer Windows { int windows[]; };

void main() {
    uint i = item();
    if (i >= list_count) return;
    uint entry = texelFetch(listed, int(i)).r, row = row_in(entry);
    int face = face_in(entry);
    vec3 spot = texelFetch(spots, int(row)).xyz, sight;
    find_sight(spot, face, sight);
    float spacing = sparser * texelFetch(spacings, int(row)).r;
    float wide = max(abs(sight.x), abs(sight.y));
    float cells = sqrt(1.0 + tangent * tangent * (wide * wide)) / sector_size();  // that a length takes
    float reach = min(REACH * spacing / (unit * depth_unit(farther_of(spot))), float(FARTHEST) / cells);
    discs[i] = vec4(sight, face == face_at(spot) ? reach : -reach);
    int window = int(ceil(reach * cells));
    if (window <= WINDOW) return;
    ivec2 cell = cell_of(sight.xy);
    ivec2 first = block_of(max(cell - window, ivec2(0))), last = block_of(min(cell + window, ivec2(line_length() - 1)));
    for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x) atomicMax(windows[block_at(ivec3(x, y, face))], window);
}
