"""Constants that Python and shaders share: every shader has all of these under the same names."""

from __future__ import annotations

from .. import srgb
from ..scan import grid_normals, points

NOTHING = points.NOTHING
NO_DEPTH = 0x7F800000  # +inf as float bits: the depth where nothing is
EMPTY = 255  # the level of a pixel that shows nothing
UNKNOWN = 3e38  # a radius, or a normal's length, that is not less says nothing
LEAST_RADIUS = 0.7072  # pixels: a smaller disc or ball may miss all pixel centres
BEHIND = 2.0**64  # what depth-buffer values are divided by of splats that fill, behind all others
LAYER_SLOPE = 6.0  # scan units along the view axis at most for one across a layer of splats
GROUP = 256  # invocations of a work group
GROUP_LIMIT = 65535  # work groups that every driver allows along one dimension
STEEPEST = grid_normals.STEEPEST  # depth step between samples of one surface, in their lateral spacing

# The table of range views: texels of four words.
RANGE_Z, RANGE_ALONG_RAY, RANGE_HEIGHT = 1, 2, 4  # what a depth is
RANGE_LEVELS_AT = 11  # of a view's texels, the first of its levels
RANGE_MOST_LEVELS = 8
RANGE_ENTRY = RANGE_LEVELS_AT + RANGE_MOST_LEVELS
RANGE_TILE = 16  # samples along an edge of a tile
RANGE_TILE_TEXELS = 3

SRGB_SLOPE = srgb.SLOPE
SRGB_OFFSET = srgb.OFFSET
SRGB_SCALE = srgb.SCALE
SRGB_POWER = srgb.POWER
SRGB_LINEAR_KNEE = srgb.LINEAR_KNEE
SRGB_ENCODED_KNEE = srgb.ENCODED_KNEE
LIGHT_STEPS = float(srgb.LIGHT_STEPS)
LIGHT_ROOTS = float(srgb.LIGHT_ROOTS)
LIGHT_PARTS = srgb.LIGHT_PARTS


def constants_glsl() -> str:
    """The constants as macros; bit patterns are unsigned."""
    constants = {name: value for name, value in globals().items() if name.isupper()}
    return "".join(f"#define {name} {_literal(value)}\n" for name, value in constants.items())


def _literal(value: float) -> str:
    return f"0x{value:08X}u" if isinstance(value, int) and value >> 16 else repr(value)
