"""How far apart the points of a cloud are, in a few milliseconds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .points import PointCloud

_DISTANCES = 2_000_000  # point-to-point distances looked at
_NEAREST = (128, 8192)  # of these: six neighbours, each with twenty copies or with a thousand
_NEIGHBOR = 6  # on a surface, the ring of nearest neighbours


def typical_spacing(cloud: PointCloud) -> float:
    """The median distance between neighbours, scan units; 1.0 where all points coincide.

    See `spacings`.
    """
    return float(np.median(spacings(cloud)))


def spacings(cloud: PointCloud) -> NDArray[np.float64]:
    """The distance between neighbours at some places of a cloud, (P,), scan units; P > 0.

    A few points are compared with all others. On a surface of one point per s^2 there are
    k points within s sqrt(k / pi), so the distance to the sixth neighbour gives s; copies of
    a point do not count.
    """
    count = len(cloud)
    if count < 2:
        return np.ones(1)
    rows = np.linspace(0, count - 1, max(8, min(64, _DISTANCES // count))).astype(int)
    found = [spacing for row in rows if (spacing := spacing_at(cloud, row)) is not None]
    return np.array(found or [1.0])


def spacing_at(cloud: PointCloud, row: int) -> float | None:
    """The distance between neighbours around one point, scan units; None where all points are
    copies of it.

    It looks at every point once: about 15 ms for a million. See `spacings`.
    """
    points = cloud.positions
    squared = sum((points[:, axis] - points[row, axis]) ** 2 for axis in range(3))
    for nearest in _NEAREST:
        near = np.argpartition(squared, min(nearest, len(points)) - 1)[:nearest]
        _, first = np.unique(points[near], axis=0, return_index=True)
        if len(first) > _NEIGHBOR:
            break
    distinct = np.sort(squared[near[first]])[1:]  # without the point itself
    k = min(_NEIGHBOR, len(distinct))
    return float(np.sqrt(distinct[k - 1] / (k / np.pi))) if k else None
