// A splat where the first pass found nothing: behind all of that by an exact power of two, its depth negative.
#define BEHIND 18446744073709551616.0
#define SIGN -1.0
#include "surfels/splat.frag"
