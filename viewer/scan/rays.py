"""Points of a cloud near a ray, in a few milliseconds for a million."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .points import PointCloud

_PART = 1 << 18  # points that are looked at together, so that little memory is needed


class Ray(NamedTuple):
    """A line. start, step: (3,), a position on it and its direction, of any length, scan units."""

    start: NDArray[np.float64]
    step: NDArray[np.float64]

    def across(self) -> NDArray[np.float64]:
        """Two unit vectors at right angles to the ray and to each other, (3, 2)."""
        return np.linalg.svd(self.step[None])[2][1:].T

    def away(self, positions: NDArray[np.floating]) -> NDArray[np.float64]:
        """Distances of positions (N, 3) from the line, (N,)."""
        return np.linalg.norm((positions - self.start) @ self.across(), axis=1)


def rows_along(
    cloud: PointCloud, ray: Ray, reach: float, some: NDArray[np.integer] | None = None
) -> NDArray[np.intp]:
    """Rows of the points that are so near to a ray, ascending. It looks at every point once.

    ray: in coordinates relative to the cloud's origin. some: rows (n,) to look at alone.
    """
    across = ray.across()
    middle = (ray.start @ across).astype(np.float32)
    axes = across.astype(np.float32)
    found = [np.empty(0, np.intp)]
    for rows, points in _parts(cloud.positions, some):
        x, y = (points @ axes - middle).T
        near = np.flatnonzero(np.abs(x) <= reach)
        near = near[x[near] ** 2 + y[near] ** 2 <= reach**2]
        found.append(near + rows.start if isinstance(rows, slice) else rows[near].astype(np.intp))
    return np.sort(np.concatenate(found))


def _parts(
    points: NDArray[np.float32], some: NDArray[np.integer] | None
) -> Iterator[tuple[slice | NDArray[np.integer], NDArray[np.float32]]]:
    """Points in parts, and their rows."""
    for start in range(0, len(points) if some is None else len(some), _PART):
        rows = slice(start, start + _PART) if some is None else some[start : start + _PART]
        yield rows, points[rows]
