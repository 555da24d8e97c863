"""Search on the CPU, for a view: the radius of the flip, and the points that the exact operator sees."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..gpu import gl
from ..gpu.context import Gpu
from ..scan.points import PointCloud
from ..view import View
from .calibration import calibrate, directions_of
from .clipping import near_plane
from .exact import SeenPoints, flipping, hull_rows, katz_radius
from .sectors import Sectors

_FAR = 1e4  # radii of the scan, from where the operator sees almost parallel rays


class FoundOnCpu(NamedTuple):
    """Result of `find_on_cpu` for a view.

    radius: R, distances from the eye to the farthest point. visible: (N,) uint32, 1 where a point is visible;
    None: nobody asked for it.
    """

    radius: float
    visible: NDArray[np.uint32] | None


def find_on_cpu(
    cloud: PointCloud, view: View, depth: float, radius: float | None, *, searched: bool, exact: bool
) -> FoundOnCpu:
    """Find the radius for a cloud with points, and, `exact`, which of them the exact operator calls visible.

    depth, radius: see `SearchSettings`. searched: whether Katz's search finds the radius where it is None, in
    place of the density of the points. Points before the near plane hide nothing, and are not visible. For
    parallel rays, the eye lies 10,000 radii away. Raises InputError if a search is asked for such rays.
    """
    sectors, body = directions_of(cloud, view.origin, view)
    far = _FAR * body.radius
    eye = view.eye if view.perspective else body.center + far * view.rotation[2]
    if radius is None and searched:
        if not view.perspective:
            raise InputError(
                "the search for the radius needs a perspective camera",
                hint="Use --set radius_by=spacing, or a perspective camera",
            )
        radius = katz_radius(cloud, eye) / sectors.farthest
    given = None if radius is None or math.isinf(sectors.farthest) else radius * sectors.farthest
    found = calibrate(cloud, sectors, view.origin, depth, given)
    length = found.radius if view.perspective else _radius_for(found.sectors, far)
    if not exact:
        return FoundOnCpu(length / sectors.farthest, None)
    x, y, z, offset = near_plane(view, body)
    positions = cloud.positions + (cloud.origin - view.origin)
    rows = np.flatnonzero(positions @ np.array([x, y, z]) + offset >= 0)
    visible = np.zeros(len(cloud), np.uint32)
    if len(rows):
        seen = SeenPoints.of(cloud, eye)[rows]
        length = max(length, float(seen.distance.max()))
        visible[rows[hull_rows(seen, flipping(seen, length))]] = 1
    return FoundOnCpu(length / sectors.farthest, visible)


def _radius_for(sectors: Sectors, distance: float) -> float:
    """The radius of a flip, scan units, that gives points this far away the weight of sectors for parallel
    rays: the inverse of `Sectors.flipped`."""
    return sectors.weight * distance**2 / sectors.unit + distance / 2


class ExactlySeen:
    """Result of `find_on_cpu` on the GPU, for pictures of that view.

    visible: R32UI, a texel a row, 1 where it is visible. state: another object for each result.
    """

    def __init__(self, gpu: Gpu, found: FoundOnCpu) -> None:
        self._gpu, self.radius = gpu, found.radius
        flags = np.empty(0, np.uint32) if found.visible is None else found.visible
        self._counts = {"in": len(flags), "visible": int(flags.sum())}
        self.visible = gl.BufferTexture(gpu.buffer(flags if len(flags) else np.zeros(1, np.uint32)), gl.R32UI)
        self.state = object()

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU: 4 a point."""
        return self.visible.buffer.size

    def count(self) -> dict[str, int]:
        """How many points there are, and are visible."""
        return self._counts

    def release(self) -> None:
        """Delete it."""
        self._gpu.discard(self.visible)
