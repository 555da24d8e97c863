"""Picking on what is seen: what one pixel of a Surface shows, never a point behind it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..geometry import Vector
from ..gpu.constants import EMPTY, NOTHING
from ..gpu.surface import Surface
from ..scan.spacing import ENOUGH, spacing_at

_REACH = 4  # pixels round one that are looked at: gaps that are wider are seen as such
_BEHIND = 4.0, 4.0 * _REACH  # spacings and pixels that what is seen through a gap is behind it, at least
_WIDEST = 5 / 6 * np.pi  # angle without any of those that lie all round


@dataclass(frozen=True, eq=False)
class Picked:
    """Content of a pixel: a place on the surface, and the point of the scan that gave it.

    position: (3,) float64, scan units: the surface at the pixel's centre. Places and normals are the world's,
    into which the layers of the picture may have moved the scan.
    level: 0 measured, n filled from level n; the fields below are empty where it was filled.
    row: the point's place in the cloud's arrays; the first of several that are shown as one. id: its index
    in the file.
    point: (3,) float64, scan units: the point itself. color: (4,) uint8, sRGB and alpha.
    normal: (3,) float32. These two are the scan's own, None where it has none.
    scalars: name -> number, of the scan, of layers, and the one that the backend found for the picture.
    spacing: distance between the points around it, scan units: how uncertain `point` is as a
    place on the body. None where it was not asked for or all points coincide.
    """

    position: NDArray[np.float64]
    level: int
    row: int | None = None
    id: int | None = None
    point: NDArray[np.float64] | None = None
    color: NDArray[np.uint8] | None = None
    normal: NDArray[np.float32] | None = None
    scalars: Mapping[str, float] = field(default_factory=dict)
    spacing: float | None = None

    @property
    def place(self) -> Vector:
        """The position as a tuple."""
        x, y, z = (float(v) for v in self.position)
        return x, y, z

    @property
    def measured(self) -> bool:
        """Whether a point of the scan is seen, rather than a filled hole."""
        return self.level == 0


def pick(surface: Surface, x: int, y: int, *, spacing: bool = True) -> Picked | None:
    """Pick what pixel (x, y) shows, row 0 at the top; None where it shows nothing or is none of the picture.

    Reads one pixel from the GPU. spacing: whether to find the spacing too, which looks at every point of the
    cloud (see `spacing_at`), or of range views at the pixels around.
    """
    if not _has(surface, x, y):
        return None
    depth, row, level = surface.texel(x, y)
    if level == EMPTY:
        return None
    center = np.array([[x + 0.5, y + 0.5]])
    place = surface.layers.place
    position = place.points(surface.view.unproject(center, np.array([depth]))[0] + surface.view.origin)
    if row == NOTHING:
        return Picked(position, level)
    cloud, at = surface.point_at(row, least=ENOUGH if spacing else 1)
    found = surface.found_at(row)
    row = surface.point_of(row)
    scalars = {name: values[at].item() for name, values in cloud.scalars.items()}
    scalars |= {name: values[row].item() for name, values in surface.layers.scalars.items()}
    return Picked(
        position,
        level,
        row,
        id=row if cloud.ids is None else int(cloud.ids[at]),
        point=place.points(cloud.world(at)),
        color=None if cloud.colors is None else cloud.colors[at].copy(),
        normal=None if cloud.normals is None else place.directions(cloud.normals[at].copy()),
        scalars=scalars | found,
        spacing=spacing_at(cloud, at) if spacing else None,
    )


def before_gap(surface: Surface, x: int, y: int) -> tuple[int, int]:
    """The pixel that is meant by (x, y): itself; or the nearest one of the front, where (x, y) is seen
    through a gap between the points of that.

    Such a pixel is far behind others that lie all round it. At an edge they lie on one side.
    """
    if not _has(surface, x, y) or (texel := surface.texel(x, y)).level == EMPTY:
        return x, y
    depths = surface.depth_around(x, y, _REACH)
    ends = surface.view.unproject(np.array([[x, y], [x + 1, y]]), np.full(2, texel.depth))
    spacings, pixels = _BEHIND
    limit = texel.depth - pixels * np.linalg.norm(ends[1] - ends[0])
    front = depths < limit
    if front.any():
        front &= depths < limit - spacings * surface.scanned.pose.spacing
    down, across = np.argwhere(front).T - _REACH
    if not _lie_all_round(down, across):
        return x, y
    nearest = np.argmin(down**2 + across**2)
    return x + int(across[nearest]), y + int(down[nearest])


def _has(surface: Surface, x: int, y: int) -> bool:
    return 0 <= x < surface.size[0] and 0 <= y < surface.size[1]


def _lie_all_round(down: NDArray[np.intp], across: NDArray[np.intp]) -> bool:
    """Whether places lie round the origin in all directions; not so on one side of a line."""
    angles = np.sort(np.arctan2(down, across))
    return len(angles) > 0 and bool(np.diff(angles, append=angles[0] + 2 * np.pi).max() < _WIDEST)


def is_seen(surface: Surface, position: ArrayLike, slack: float) -> bool:
    """Whether a place lies in the picture with nothing before it.

    Reads one pixel from the GPU. position: (3,), scan units. slack: how far before the place, scan units, the
    surface may be that still is the place's own.
    """
    unmoved = surface.layers.place.inverse.points(np.asarray(position, np.float64))
    offset = (unmoved - surface.view.origin)[None]
    if not surface.view.contains(offset)[0]:
        return False
    pixels, depths = surface.view.project(offset)
    x, y = (int(v) for v in pixels[0])
    texel = surface.texel(x, y)
    return texel.level == EMPTY or texel.depth >= depths[0] - slack
