// Neighbors that an earlier picture of the same points found. They are the same from each eye if all points within the ball
// around them take part, in both pictures.
layout(binding = TEXTURE_ROWS) uniform usamplerBuffer shown_rows;  // of pixels
layout(binding = TEXTURE_FARTHEST) uniform samplerBuffer farthest;
layout(binding = TEXTURE_COPIED) uniform usamplerBuffer copied;
// First how many points of this picture had them; then of each row a stamp, and the K rows, the nearest first.
layout(std430, binding = STORAGE_KEPT) buffer Kept { uint kept[]; };
uniform uint stamp;

uint place_of_kept(uint row) { return 1u + (uint(K) + 1u) * row; }

// Whether each point of the scan takes part that lies within the ball round `center`: none is outside of the grids or of
// the depth range, behind what takes part there, or left out as a copy. squared: of the radius, in the scan's size.
bool takes_all(float squared) {
    float radius = 1.001 * sqrt(squared) / unit, depth = -center.z;
    if (depth - radius < view_near || depth + radius > view_far) return false;
    vec2 x = tangents(center.x, radius, view_center.x), y = tangents(-center.y, radius, view_center.y);
    vec4 box = floor(vec4(x.x, y.x, x.y, y.y) + ROUNDING * vec4(-2.0, -2.0, 2.0, 2.0));
    if (any(lessThan(box.xy, vec2(-margin))) || any(greaterThanEqual(box.zw, vec2(view_size + margin)))) return false;
    ivec4 cells = (ivec4(box) + margin) >> coarse_shift;
    for (int row = cells.y; row <= cells.w; ++row)
        for (int column = cells.x; column <= cells.z; ++column) {
            int cell = row * coarse_size.x + column;
            if (texelFetch(farthest, cell).r < 1.00001 * (depth + radius) || texelFetch(copied, cell).r != 0u) return false;
        }
    return true;
}

// As arrange.comp has it.
bool is_hidden(uint row, vec3 position) {
    vec2 pixel;
    find_pixel(to_view(position), pixel);
    return in_picture(pixel) && texelFetch(shown_rows, pixel_number(pixel)).r != row;
}

// Takes the neighbors that are kept of a row; false where there are none that count in this picture.
bool take_kept(uint row, vec3 place) {
    uint at = place_of_kept(row);
    if (kept[at] != stamp) return false;
    for (int k = 0; k < K; ++k) {
        uint other = kept[at + 1u + uint(k)];
        vec3 position = texelFetch(positions, int(other)).xyz, offset = position * unit - place;
        near_squared[k] = squared_length(offset);
        near_rows[k] = 2u * other + uint(is_hidden(other, position));
    }
    if (!takes_all(near_squared[K - 1])) return false;
    atomicAdd(kept[0], 1u);
    return true;
}

// Keeps the neighbors that were taken, if no other eye finds others. known: the distance within which all were taken.
void keep(uint row, float known) {
    float squared = near_squared[K - 1];
    if (near_rows[K - 1] == NOTHING || squared > known * known || !takes_all(squared)) return;
    uint at = place_of_kept(row);
    kept[at] = stamp;
    for (int k = 0; k < K; ++k) kept[at + 1u + uint(k)] = near_rows[k] >> 1;
}
