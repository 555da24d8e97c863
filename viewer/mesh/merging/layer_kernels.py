"""The inner loop of finding where one view's triangles lie behind positions in another's picture, compiled by
numba; see `surfaces`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled

_EDGE = 1e-6  # of a triangle: how far outside of it a position still counts, so that none falls between two


class PositionsByPixel(NamedTuple):
    """Q positions of a picture, sorted by the pixels that they lie in."""

    pixels: NDArray[np.float64]  # (Q, 2), column and row
    depth: NDArray[np.float64]  # (Q,)
    order: NDArray[np.intp]  # (Q,), by pixel
    first: NDArray[np.intp]  # (width * height + 1,), where each pixel begins in the order
    width: int
    height: int


class LayerHits(NamedTuple):
    """The triangle that is found for each of Q positions."""

    offset: NDArray[np.float64]  # (Q,), its depth less the position's; inf where none is
    found: NDArray[np.int64]  # (Q,), its row
    share: NDArray[np.float32]  # (Q, 2), the weights of its second and third corner


@compiled
def nearest_layer(
    positions: PositionsByPixel,
    corners: NDArray[np.float64],
    faces: NDArray[np.uint32],
    is_parallel: bool,
    hits: LayerHits,
) -> None:
    """Find for each position of a picture the triangle over it whose depth differs least from its own.

    corners: (V, 3), column, row, and depth in a parallel projection, else one over it, of which faces (F, 3)
    are made.
    """
    pixels, depth, order, first, width, height = positions
    offset, found, share = hits
    for face in range(len(faces)):
        a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
        ax, ay = corners[a, 0], corners[a, 1]
        bx, by = corners[b, 0] - ax, corners[b, 1] - ay
        cx, cy = corners[c, 0] - ax, corners[c, 1] - ay
        area = bx * cy - cx * by
        if not abs(area) > 0.0:
            continue
        left = int(min(max(ax + min(0.0, bx, cx), 0.0), width - 1.0))
        right = int(min(max(ax + max(0.0, bx, cx), 0.0), width - 1.0))
        top = int(min(max(ay + min(0.0, by, cy), 0.0), height - 1.0))
        bottom = int(min(max(ay + max(0.0, by, cy), 0.0), height - 1.0))
        for row in range(top, bottom + 1):
            for n in range(first[row * width + left], first[row * width + right + 1]):
                at = order[n]
                x, y = pixels[at, 0] - ax, pixels[at, 1] - ay
                second = (x * cy - cx * y) / area
                third = (bx * y - x * by) / area
                if second < -_EDGE or third < -_EDGE or second + third > 1.0 + _EDGE:
                    continue
                start = corners[a, 2]
                value = start + second * (corners[b, 2] - start) + third * (corners[c, 2] - start)
                change = (value if is_parallel else 1.0 / value) - depth[at]
                if abs(change) < abs(offset[at]):
                    offset[at], found[at] = change, face
                    share[at, 0], share[at, 1] = second, third
