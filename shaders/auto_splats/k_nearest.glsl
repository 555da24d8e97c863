// The nearest K that were taken, by distance, then by row. near_rows: twice the row, 1 more where it is hidden;
// NOTHING: none.
float near_squared[K];
uint near_rows[K];

void clear_nearest() {
    for (int k = 0; k < K; ++k) {
        near_squared[k] = UNKNOWN;
        near_rows[k] = NOTHING;
    }
}

bool goes_before(float squared, uint row, int k) {
    return squared < near_squared[k] || (squared == near_squared[k] && row < near_rows[k]);
}

void take_squared(float squared, uint row) {
    bool before = goes_before(squared, row, K - 1);
    for (int k = K - 1; k > 0; --k) {
        bool before_next = goes_before(squared, row, k - 1);
        near_squared[k] = before_next ? near_squared[k - 1] : before ? squared : near_squared[k];
        near_rows[k] = before_next ? near_rows[k - 1] : before ? row : near_rows[k];
        before = before_next;
    }
    near_squared[0] = before ? squared : near_squared[0];
    near_rows[0] = before ? row : near_rows[0];
}

float squared_length(vec3 offset) {
    precise float squared = offset.x * offset.x + offset.y * offset.y;
    squared = squared + offset.z * offset.z;
    return squared;
}

void take(vec3 offset, uint row) { take_squared(squared_length(offset), row); }

// A neighborhood, as far as it is known. count: its participants, the point among them; squared: of its
// radius; search: how far others could belong to it that are not known yet, 0 where none could.
struct Extent { int count; float squared; float search; };

// A neighborhood ends with its k-th, or before a gap (Preiner 2012, 5.3): where a ball round those found so
// far, at least of the usual radius, can grow to `growth` times its area without a further one; and round
// the point alone to `alone` times the usual radius, where outliers are dropped. All participants within
// `known` were taken.
Extent extent_of(float known, float usual) {
    Extent extent = Extent(1, 0.0, 0.0);
    float limit = drops ? usual * alone : UNKNOWN;
    bool open = true;
    for (int k = 1; k < K; ++k) {
        bool is_known = near_rows[k] != NOTHING && near_squared[k] <= known * known;
        if (open && is_known && near_squared[k] <= limit * limit) {
            extent.count = k + 1;
            extent.squared = near_squared[k];
            limit = sqrt(growth) * max(sqrt(near_squared[k]), usual);
        } else if (open) {
            open = false;
            if (!is_known && known < min(limit, UNKNOWN)) extent.search = limit;
        }
    }
    // Up to the k-th where it is near enough, so that one more search will do; else by steps, since cells
    // that are far may be many.
    float last = sqrt(near_squared[K - 1]);
    if (extent.search > 0.0) extent.search = last < 2.0 * known ? last : min(extent.search, 2.0 * known);
    return extent;
}
