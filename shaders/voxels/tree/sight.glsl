// A view of an octree; positions are relative to the lowest corner of its cube. Doubles, as the CPU computes with: whether a
// node counts as small decides which are drawn.
const int MOST_LEVELS = 22;

struct Level {
    double edge;
    double margin;  // how far what is drawn of a node reaches beyond its sphere
    double least;   // smaller nodes, pixels, are not divided; 0: none is so small
    uint start;     // the number of the first node
    uint last;      // whether no node is divided
};

layout(std430, binding = STORAGE_SIGHT) readonly buffer Sight {
    double planes[24];  // four each: inward unit normals, offsets
    double eye[3];
    double back[3];  // opposite to the direction of the view
    double view_pixels;  // per unit, at depth 1 or everywhere
    double nearest_depth;
    double low[3];  // of the cube, relative to the origin of positions
    uint plane_count;
    uint is_perspective;
    Level levels[MOST_LEVELS];
};

// Work groups of a dispatch over the nodes of a level, how many nodes that is and how many the next level has; nodes left out
// by cause; nodes of each level that are shown.
layout(std430, binding = STORAGE_CUT_TOTALS) buffer Totals {
    uint groups_x, groups_y, groups_z, count;
    uint next_count, outside, facing_away, spare;
    uint shown[MOST_LEVELS];
};
