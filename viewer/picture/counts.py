"""What became of the points of a picture. Plain numpy, on any thread."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..gpu.constants import NOTHING
from ..scan.points import PointCloud
from ..scan.range_points import RangePoints
from ..task import checkpoint
from ..view import View
from .sample import is_sampled

_CHUNK = 1 << 20  # points counted at a time
Part = tuple[NDArray[np.int64], NDArray, NDArray | None]  # rows, positions, normals


class Counted(NamedTuple):
    """The points of a scan, to be counted."""

    total: int
    dropped: int  # not finite
    numbered: int  # rows that they are numbered by
    origin: NDArray[np.float64]
    parts: Callable[[], Iterator[Part]]  # some points at a time


def cloud_counted(cloud: PointCloud) -> Counted:
    """The points of a cloud."""
    return Counted(len(cloud), cloud.dropped, len(cloud), cloud.origin, partial(_parts, cloud))


def samples_counted(points: RangePoints) -> Counted:
    """The points of range views, which are not merged, and have no normals here."""

    def parts() -> Iterator[Part]:
        return ((*part, None) for part in points.parts())

    return Counted(points.count, 0, int(points.firsts[-1]), points.overview.origin, parts)


def count_points(
    points: Counted,
    view: View,
    rows: NDArray[np.uint32],
    share: float,
    faces_away: bool = False,
) -> dict[str, int]:
    """Count what became of the points of the file: "in", and of these "drawn" (they have a pixel),
    "dropped" (not finite), "preview" (not in the share that was drawn from; only where that is not
    all), "outside" (the centre is not in the picture or not between near and far), "away" (they face
    away from the eye; only where such points were left out) and "hidden" (the rest).

    rows: (H, W), which
    point each pixel shows, or sample of range views; 0xFFFFFFFF where none. faces_away: whether points that
    face away were left out.
    """
    count, dropped = points.total, points.dropped
    moved = points.origin - view.origin
    shown = np.zeros(points.numbered, bool)
    shown[rows[rows != NOTHING]] = True
    seen = hidden = left_out = away = 0
    for numbers, positions, normals in points.parts():
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


def _parts(cloud: PointCloud) -> Iterator[Part]:
    """Rows, positions and normals of a part of the points at a time."""
    for start in range(0, len(cloud), _CHUNK):
        part = slice(start, min(start + _CHUNK, len(cloud)))
        normals = None if cloud.normals is None else cloud.normals[part]
        yield np.arange(part.start, part.stop), cloud.positions[part], normals
