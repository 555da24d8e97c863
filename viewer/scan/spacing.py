"""How far apart the points of a cloud are, in a few milliseconds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .points import PointCloud

_DISTANCES = 2_000_000  # point-to-point distances looked at
_NEAREST = 128  # of these, so that each of six neighbours may have twenty copies
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
    points = cloud.positions
    count = len(points)
    if count < 2:
        return np.ones(1)
    probes = points[np.linspace(0, count - 1, max(8, min(64, _DISTANCES // count))).astype(int)]
    found = []
    for probe in probes:
        squared = sum((points[:, axis] - probe[axis]) ** 2 for axis in range(3))
        nearest = np.partition(squared, min(_NEAREST, count) - 1)[:_NEAREST]
        distinct = np.unique(nearest[nearest > 0])  # copies of a point are at one distance
        k = min(_NEIGHBOR, len(distinct))
        if k:
            found.append(float(np.sqrt(distinct[k - 1] / (k / np.pi))))
    return np.array(found or [1.0])
