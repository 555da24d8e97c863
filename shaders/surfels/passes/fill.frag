// A splat where the first pass found nothing: behind all of that by an exact power of two, its depth negative.
#define DIVISOR BEHIND
#define SIGN -1.0
#include "surfels/splat.frag"
