// A point as every feed hands it to a shape.
struct Point {
    vec3 position;  // relative to the pose's origin
    vec3 normal;    // as stored
    float radius;   // as stored, 0 where the scan has none
    vec4 axes;      // one half-axis, and the length of the other; 0 where the splat is round
    vec4 cell;      // as surfels/cell.glsl reads it; 0 where the point is the splat's centre and nothing ends it
    uint row;
};

#ifdef FED_COLOR
vec3 fed_color;  // sRGB, of the point that was fetched
#endif

#ifdef SHADED
// The colour of the point that was fetched, sRGB; by its normal where the feed brings none (Slomp 2014, III).
vec3 color_of(Point point) {
#ifdef FED_COLOR
    return fed_color;
#else
    return 0.5 + 0.5 * normalize(point.normal);
#endif
}
#endif

// What a shape's size is multiplied by, so that the points drawn make up for those left out.
uniform float enlarged;

// A corner of the amplified shape.
struct Corner {
    vec3 view;   // view space
    vec2 local;  // within the shape, -1..1
};
