// Lists the quads of sectors that have faces in the picture, those of more than LARGE pixels apart; and marks the points
// that are corners of a face, in the picture or not.
#include "common/item.glsl"
#include "hpr/next_list.glsl"
#include "hpr/drawn_faces.glsl"

layout(std430, binding = STORAGE_JOINED) buffer Joined { uint joined[]; };

void list_quad(uint quad) {
    Faces faces = faces_of(quad);
    int most = 0;
    for (int t = 0; t < faces.count; ++t) {
        uvec3 rows = faces.corners[t];
        if (!is_surface(rows)) continue;
        for (int k = 0; k < 3; ++k) joined[rows[k]] = 1u;
        Drawn face = drawn_face(rows);
        ivec4 pixels = pixels_in(face);
        ivec2 size = max(pixels.zw - pixels.xy, ivec2(0));
        if (face.there) most = max(most, size.x * size.y);
    }
    if (most > LARGE) next_list[reserve_next(uint(LANES)) / uint(LANES)] = quad;
    else if (most > 0) list[reserve(1u)] = quad;
}

void main() {
    uint sector = item();
    if (sector >= item_count || texelFetch(candidates, int(sector)).r == NOTHING) return;
    list_quad(4u * sector);
#if CUBE
    ivec2 at = place_of(sector).xy;
    if (at.x == 0) list_quad(4u * sector + 1u);
    if (at.y == 0) list_quad(4u * sector + 2u);
#endif
}
