"""Picking on what is seen: what one pixel of a Surface shows, never a point behind it.

The renderer tells roughly where. Which surface is seen (`front_layer`) and where it is (`local_surface`), the
points of the cloud around the pixel's ray tell: the point that wins a pixel is the nearest of many, or lies
beside it or behind them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..geometry import Vector, vector
from ..gpu.constants import EMPTY, NOTHING
from ..picture.surface import Surface
from ..scan.points import PointCloud
from ..scan.rays import Ray
from ..scan.spacing import ENOUGH, spacing_at
from .front_layer import LEFT_OUT, front_layer, lie_all_round
from .local_surface import Column, LocalSurface, Unclear
from .words import SURE

_REACH = 4  # pixels from points to the middle of a gap, where spacings are less
_GAP = 1.5  # spacings from points to the middle of a gap between them, at most
_BEHIND = (
    4.0,
    4.0,
)  # spacings and distances in the picture that what is seen through a gap is behind it, at least
_FARTHEST = 64  # pixels in which something is looked for
_COLUMN = 10.0  # spacings from the ray to points that are looked at, at first
_ENLARGED = 3  # times, to twice as many spacings each, where points are sparse
_BETWEEN = 3.0  # spacings from a filled place to points of its surface, at most, all round it
FOLLOWED = 8  # of them are kept, to follow


@dataclass(frozen=True)
class Neighbor:
    """A point near a place. id: its index in the file. offset: from the place to it, scan units."""

    id: int
    offset: Vector


@dataclass(frozen=True, eq=False)
class Picked:
    """Content of a pixel: a place on the surface, and the point of the scan that is seen there.

    position: (3,) float64, scan units: the surface at the pixel's centre. Places and normals are the world's,
    into which the layers of the picture may have moved the scan.
    level: 0 measured, n filled from level n.
    covariance: (3, 3) float64, squared scan units: how the place that was meant may lie off the position, by
    what the points leave open and by the size of the pixel, in which it may be anywhere. None: unknown.
    doubt: the chance that another surface is meant, before or behind, 0 to 1; the covariance holds it where
    that one is seen.
    neighbors: points of the surface around it, the nearest first; none where few are seen.
    between: whether it was filled between points of one surface that lie all round it, a few spacings away.
    The fields below are empty where it was filled.
    row: the point's place in the cloud's arrays; the first of several that are shown as one. id: its index
    in the file.
    point: (3,) float64, scan units: the point itself. color: (4,) uint8, sRGB and alpha.
    normal: (3,) float32. These two are the scan's own, None where it has none.
    scalars: name -> number, of the scan, of layers, and the one that the backend found for the picture.
    spacing: distance between the points around it, scan units. None where it was not asked for or all points
    coincide.
    """

    position: NDArray[np.float64]
    level: int
    covariance: NDArray[np.float64] | None = None
    neighbors: tuple[Neighbor, ...] = ()
    doubt: float = 0.0
    between: bool = False
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
    def uncertainty(self) -> float | None:
        """How far off the position the place that was meant is at most, along any one line, with 95 %; scan
        units. None where it is unknown."""
        return None if self.covariance is None else largest_deviation(self.covariance)

    @property
    def at_outline(self) -> bool:
        """Whether another surface may be meant, in more than the 5 % that are left out of what is said."""
        return self.doubt > LEFT_OUT

    @property
    def measured(self) -> bool:
        """Whether a point of the scan is seen, rather than a filled hole."""
        return self.level == 0


def largest_deviation(covariance: NDArray[np.float64]) -> float:
    """The deviation that 95 % do not exceed, along the line on which it is largest. covariance: (3, 3)."""
    return SURE * float(np.sqrt(max(np.linalg.eigvalsh(covariance)[-1], 0.0)))


def pick(
    surface: Surface, x: int, y: int, *, shown: tuple[int, int] | None = None, spacing: bool = True
) -> Picked | None:
    """Pick what pixel (x, y) shows, row 0 at the top; None where it shows nothing or is none of the picture.

    Reads a pixel from the GPU, and looks at the points of the cloud once; of range views, at those that
    pixels around show. shown: the pixel that shows the surface which is meant, where it is another one
    (`before_gap`). spacing: whether to find the spacing too, which looks at every point once more (see
    `spacing_at`).
    """
    across, down = shown or (x, y)
    if not (_has(surface, x, y) and _has(surface, across, down)):
        return None
    depth, row, level = surface.texel(across, down)
    if level == EMPTY:
        return None
    place, pixel = surface.layers.world_from_pose, np.array([x + 0.5, y + 0.5])
    column, found = _seen(surface, pixel, depth)
    if row == NOTHING:
        between = found is not None and _is_between(surface, pixel, found, column.positions)
        if found is not None and not between:  # the renderer's word stands; how far points disagree counts
            found = found._replace(
                depth=depth, deviation=float(np.hypot(found.deviation, found.depth - depth))
            )
        return Picked(
            _position(surface, pixel, depth if found is None else found.depth),
            level,
            *_shown_by(surface, pixel, found, column),
            doubt=0.0 if found is None else found.doubt,
            between=between,
        )
    cloud, at = surface.point_at(row, least=ENOUGH if spacing else 1)
    id_ = at if cloud.ids is None else int(cloud.ids[at])
    if found is None:
        pixel = np.array([across + 0.5, down + 0.5])
        depth = _measured_depth(surface, cloud, at, depth)
    numbers = surface.found_at(row)
    row = surface.point_of(row)
    scalars = {name: values[at].item() for name, values in cloud.scalars.items()}
    scalars |= {name: values[row].item() for name, values in surface.layers.scalars.items()}
    return Picked(
        _position(surface, pixel, depth if found is None else found.depth),
        level,
        *_shown_by(surface, pixel, found, column),
        doubt=0.0 if found is None else found.doubt,
        row=row,
        id=id_,
        point=place.points(cloud.world(at)),
        color=None if cloud.colors is None else cloud.colors[at].copy(),
        normal=None if cloud.normals is None else place.directions(cloud.normals[at].copy()),
        scalars=scalars | numbers,
        spacing=spacing_at(cloud, at) if spacing else None,
    )


def _measured_depth(surface: Surface, cloud: PointCloud, at: int, depth: float) -> float:
    """The depth of a point of a cloud as measures use it, if the picture shows averages that they do not use;
    else the depth that the picture shows."""
    pose = surface.scanned.pose
    if pose.measured is pose:
        return depth
    return float(surface.view.depths(cloud.world(np.array([at])) - surface.view.origin)[0])


def _is_between(
    surface: Surface, pixel: NDArray[np.float64], found: LocalSurface, points: NDArray[np.float64]
) -> bool:
    """Whether points of a surface lie all round a place of it in the picture, a few spacings away at most,
    and tell where it is."""
    spacing = surface.scanned.pose.spacing
    place = surface.view.unproject(pixel[None], np.array([found.depth]))[0]
    near = points[found.used]
    near = near[np.linalg.norm(near - place, axis=1) <= _BETWEEN * spacing]
    if not len(near) or SURE * found.deviation > _BETWEEN * spacing:
        return False
    across, down = (surface.view.project(near)[0] - pixel).T
    return lie_all_round(down, across)


def _seen(surface: Surface, pixel: NDArray[np.float64], depth: float) -> tuple[Column, LocalSurface | None]:
    """The points round the ray through a place of the picture, and the surface that they show there; None
    where they do not tell. depth: what the picture shows."""
    usual = surface.scanned.pose.spacing
    for enlarged in range(_ENLARGED + 1):
        reach = _COLUMN * usual * 2**enlarged
        column = _column(surface, pixel, depth, reach)
        if enlarged == _ENLARGED:
            column = column._replace(reach=np.inf)
        found = front_layer(column, depth)
        if found is not Unclear.NARROW and found is not Unclear.FEW:
            break
    return column, None if isinstance(found, Unclear) else found


def _column(surface: Surface, pixel: NDArray[np.float64], depth: float, reach: float) -> Column:
    """The points that are so near to the ray through a place of the picture, scan units."""
    view = surface.view
    ids, points = surface.points_along(pixel, depth, reach)
    pixels, depths = view.project(points)
    step = view.along(pixel)
    ray = Ray(view.unproject(pixel[None], np.ones(1))[0] - step, step)
    usual = surface.scanned.pose.spacing
    return Column(view, ray, ids, points, pixels - pixel, depths, ray.away(points), reach, usual)


def _pitch(surface: Surface, depth: float) -> float:
    """The usual distance between points at a depth, pixels."""
    return float(surface.scanned.pose.spacing / surface.view.footprint(depth))


def _position(surface: Surface, pixel: NDArray[np.float64], depth: float) -> NDArray[np.float64]:
    """The place in the world, (3,), that a place of the picture (2,) shows at a depth."""
    found = surface.view.unproject(pixel[None], np.array([depth]))[0]
    return surface.layers.world_from_pose.points(found + surface.view.origin)


def _shown_by(
    surface: Surface,
    pixel: NDArray[np.float64],
    found: LocalSurface | None,
    column: Column,
) -> tuple[NDArray[np.float64] | None, tuple[Neighbor, ...]]:
    """Covariance and neighbours of a place on a local surface.

    What was meant is anywhere in the pixel: along the surface, the variance of a uniform distribution. What
    the points leave open is along the ray.
    """
    if found is None:
        return None, ()
    position = _position(surface, pixel, found.depth)
    steps = np.array([[0.5, 0.0], [0.0, 0.5]])
    aside = [
        _position(surface, pixel + step, found.depth + step @ found.slope)
        - _position(surface, pixel - step, found.depth - step @ found.slope)
        for step in steps
    ]
    deeper = surface.layers.world_from_pose.directions(surface.view.along(pixel)) * found.deviation
    off = np.column_stack([*(side / np.sqrt(12) for side in aside), deeper])
    kept = found.used[:FOLLOWED]
    offsets = surface.layers.world_from_pose.points(column.positions[kept] + surface.view.origin) - position
    neighbors = (
        Neighbor(id, vector(offset)) for id, offset in zip(column.ids[kept].tolist(), offsets, strict=True)
    )
    return off @ off.T, tuple(neighbors)


def before_gap(surface: Surface, x: int, y: int) -> tuple[int, int]:
    """The pixel that is meant by (x, y): itself; or the nearest one of the front, where (x, y) is seen
    through a gap between the points of that.

    Such a pixel is far behind others that lie all round it, or empty. At an edge they lie on one side.
    """
    if not _has(surface, x, y):
        return x, y
    shown = surface.texel(x, y).depth
    depth = shown if np.isfinite(shown) else _nearest_depth(surface, x, y)
    if not np.isfinite(depth):
        return x, y
    reach = int(np.clip(np.ceil(_GAP * _pitch(surface, depth)), _REACH, _FARTHEST))
    depths = surface.depth_around(x, y, reach)
    spacings, steepness = _BEHIND
    away = _distances(reach)
    behind = (
        steepness * np.maximum(away, _REACH) * surface.view.footprint(depth)
        + spacings * surface.scanned.pose.spacing
    )
    down, across = (
        np.argwhere((away <= max(reach, np.sqrt(2) * _REACH)) & (depths < shown - behind)).T - reach
    )
    if not lie_all_round(down, across):
        return x, y
    nearest = np.argmin(down**2 + across**2)
    meant = x + int(across[nearest]), y + int(down[nearest])
    return meant if shown < np.inf else before_gap(surface, *meant)  # which may be seen through a gap too


def _nearest_depth(surface: Surface, x: int, y: int) -> float:
    """The depth at the nearest pixel that shows something; +inf where none within `_AROUND` does."""
    reach = _FARTHEST
    depths = surface.depth_around(x, y, reach)
    return float(depths.flat[np.where(np.isfinite(depths), _distances(reach), np.inf).argmin()])


def _distances(reach: int) -> NDArray[np.float64]:
    """(2 reach + 1, 2 reach + 1), from the pixel in the middle, in pixels."""
    return np.hypot(*np.mgrid[-reach : reach + 1, -reach : reach + 1])


def _has(surface: Surface, x: int, y: int) -> bool:
    return 0 <= x < surface.size[0] and 0 <= y < surface.size[1]


def are_seen(
    surface: Surface, positions: NDArray[np.float64], slacks: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether each of many places is seen, (N,), as `is_seen` tells of one, at one reading of all pixels.

    positions: (N, 3), NaN for what is not seen. slacks: (N,).
    """
    unmoved = surface.layers.world_from_pose.inverse.points(positions) - surface.view.origin
    seen = surface.view.contains(unmoved)
    pixels, depths = surface.view.project(unmoved[seen])
    across, down = pixels.astype(np.intp).T
    before = surface.depth[down, across] - surface.view.base
    seen[seen] = before >= depths - slacks[seen]
    return seen


def is_seen(surface: Surface, position: ArrayLike, slack: float) -> bool:
    """Whether a place lies in the picture with nothing before it.

    Reads one pixel from the GPU. position: (3,), scan units. slack: how far before the place, scan units, the
    surface may be that still is the place's own.
    """
    unmoved = surface.layers.world_from_pose.inverse.points(np.asarray(position, np.float64))
    offset = (unmoved - surface.view.origin)[None]
    if not surface.view.contains(offset)[0]:
        return False
    pixels, depths = surface.view.project(offset)
    x, y = (int(v) for v in pixels[0])
    texel = surface.texel(x, y)
    return texel.level == EMPTY or texel.depth >= depths[0] - slack
