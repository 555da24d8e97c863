"""What became of the points of a picture. Plain numpy, on any thread."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..gpu.constants import NOTHING
from ..scan.points import PointCloud
from ..scan.range_points import RangePoints
from ..task import checkpoint
from ..view import View
from .sample import is_sampled

_CHUNK = 1 << 20  # points counted at a time


def count_points(
    points: PointCloud | RangePoints,
    view: View,
    rows: NDArray[np.uint32],
    share: float,
    faces_away: bool = False,
) -> dict[str, int]:
    """Count what became of the points of the file: "in", and of these "drawn" (they have a pixel),
    "dropped" (not finite), "preview" (not in the share that was drawn from; only where that is not
    all), "outside" (the centre is not in the picture or not between near and far), "away" (they face
    away from the eye; only where such points were left out) and "hidden" (the rest).

    points: those of range views are looked at without being merged, and have no normals. rows: (H, W), which
    point each pixel shows, or sample of range views; 0xFFFFFFFF where none. faces_away: whether points that
    face away were left out.
    """
    if isinstance(points, PointCloud):
        count, dropped, numbered, parts = len(points), points.dropped, len(points), _parts(points)
        origin = points.origin
    else:
        count, dropped, numbered = points.count, 0, int(points.firsts[-1])
        parts = ((*part, None) for part in points.parts())
        origin = points.overview.origin
    moved = origin - view.origin
    shown = np.zeros(numbered, bool)
    shown[rows[rows != NOTHING]] = True
    seen = hidden = left_out = away = 0
    for numbers, positions, normals in parts:
        checkpoint(seen / count)
        seen += len(numbers)
        others = ~shown[numbers]
        if share < 1:
            sampled = is_sampled(numbers.astype(np.uint32), share)
            left_out += int(np.count_nonzero(others & ~sampled))  # one shown may be from the picture before
            others &= sampled
        if moved.any():
            positions = positions + moved
        inside = view.contains(positions) & others
        if faces_away and normals is not None:
            turned = inside & view.faces_away(positions, normals)
            away += int(np.count_nonzero(turned))
            inside &= ~turned
        hidden += int(np.count_nonzero(inside))
    drawn = int(np.count_nonzero(shown))
    return {
        "in": count + dropped,
        "drawn": drawn,
        "dropped": dropped,
        **({"preview": left_out} if share < 1 else {}),
        **({"away": away} if faces_away else {}),
        "outside": count - drawn - hidden - left_out - away,
        "hidden": hidden,
    }


def _parts(cloud: PointCloud) -> Iterator[tuple[NDArray[np.int64], NDArray, NDArray | None]]:
    """Rows, positions and normals of a part of the points at a time."""
    for start in range(0, len(cloud), _CHUNK):
        part = slice(start, min(start + _CHUNK, len(cloud)))
        normals = None if cloud.normals is None else cloud.normals[part]
        yield np.arange(part.start, part.stop), cloud.positions[part], normals
