// Lists, ascending, the items of which a file says so: `is_listed(i)`.
#include "common/list.glsl"
#include <flags>

uint word_of(uint i) { return uint(is_listed(i)); }

void take_sum(uint i, uint sum) {
    uint found = word_of(i);
    if (found > 0u) list[sum] = i;
    if (i == word_count - 1u) {
        list_count = (sum + found) * EACH;
        groups_x = columns_for(list_count, groups_y);
    }
}
