"""Exact operator of hidden point removal: flipped points, and the vertices of their convex hull.

Katz 2007. With u the direction from the eye to a point, and rho its distance, the flipped point is
(2R - rho) u; it is visible where that is a vertex of the hull of all of them and the eye. Hulls are those of
Qhull (Barber 1996), in float64.

The hull stays what it is where all is scaled, and where its space is mapped by a projective map. So what
Qhull gets is not the flipped point, of which rounding leaves nothing where R or the way to the eye is long:

* relative to rho0, the distance to the middle of the points, the flipped length is 1 - d, with
  d = (rho - rho0) / (2R - rho0), and rho - rho0 comes from positions relative to that middle;
* where all points lie ahead of the eye, (x, y, z) becomes (x / z, y / z, 1 / z), z along the way to their
  middle. The eye is then infinitely far above, and the vertices are those of the hull's lower side. In
  g = (x / z, y / z), 1 / z - 1 is (|g|^2 / (1 + sqrt(1 + |g|^2)) + d) / (1 - d): nothing cancels, and g and
  heights may be as small as they are.

It is what the operator on the GPU approximates, and slow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..scan.points import PointCloud
from ..scan.pose import Pose

Floats = NDArray[np.float64]
Kernel = Callable[[Floats, Floats, float], Floats]  # see `hull_rows`

_AHEAD = 0.2  # cosine to the way to the middle above which all points count as ahead of the eye
_FLAT = 1e-6  # share of the widest extent below which there is none; what float32 leaves of flat points
_ROUNDED = 1 + 1e-6  # by which a sphere may be too small
_COARSE = 0.25  # decades between radii of a search
_DECADES = 5.0  # of multiples of the farthest distance that it looks through
_FINE = 3  # times that it halves its step


@dataclass(frozen=True, eq=False)
class SeenPoints:
    """Points as an eye sees them. All float64, scan units.

    away: (N, 3), from the eye. distance: (N,). beyond: (N,), the distance less that of the middle, as exact
    as the points are placed among each other. middle: (3,), of the box around the points, from the eye.
    offsets: (N, 3), from the middle.
    """

    away: Floats
    distance: Floats
    beyond: Floats
    middle: Floats
    offsets: Floats

    @classmethod
    def of(cls, cloud: PointCloud, eye: ArrayLike) -> SeenPoints:
        """The points of a cloud from an eye, (3,), absolute. Raises InputError for one that is not finite."""
        at = np.asarray(eye, np.float64)
        if at.shape != (3,) or not np.isfinite(at).all():
            raise InputError(f"the eye must have three finite coordinates, not {eye!r}")
        positions = cloud.positions.astype(np.float64)
        if cloud.remainders is not None:
            positions += cloud.remainders
        center = (positions.min(axis=0) + positions.max(axis=0)) / 2 if len(positions) else np.zeros(3)
        offsets, middle = positions - center, (cloud.origin - at) + center
        away = offsets + middle
        distance = np.linalg.norm(away, axis=1)
        sums = distance + np.linalg.norm(middle)
        beyond = (offsets * (offsets + 2 * middle)).sum(axis=1) / np.where(sums > 0, sums, 1)
        return cls(away, distance, beyond, middle, offsets)

    def __getitem__(self, rows: NDArray) -> SeenPoints:
        """Some of them."""
        return SeenPoints(
            self.away[rows], self.distance[rows], self.beyond[rows], self.middle, self.offsets[rows]
        )


def exact_visible_points(points: Pose | PointCloud | ArrayLike, eye: ArrayLike, radius: float) -> NDArray:
    """The points that the exact operator calls visible: ids (M,) uint32, ascending.

    points: a pose, a cloud, or (N, 3) absolute; ids count the points that it came with, also those that are
    left out because a coordinate is not finite. eye: (3,), absolute. radius: of the sphere around the eye
    that points are flipped at, scan units, not less than the distance to the farthest point. Of points at one
    position one is visible, and so is a point in the eye itself. Raises InputError.
    """
    cloud = as_cloud(points)
    seen = SeenPoints.of(cloud, eye)
    rows = hull_rows(seen, flipping(seen, radius))
    return rows.astype(np.uint32) if cloud.ids is None else cloud.ids[rows]


def as_cloud(points: Pose | PointCloud | ArrayLike) -> PointCloud:
    """The cloud of a pose, or of positions (N, 3), absolute. Raises InputError for what is neither."""
    if isinstance(points, Pose):
        return points.cloud
    return points if isinstance(points, PointCloud) else PointCloud.from_arrays(points)


def flipping(seen: SeenPoints, radius: float) -> Kernel:
    """Spherical flipping. Raises InputError where the sphere does not hold all points."""
    farthest = float(seen.distance.max(initial=0.0))
    if not farthest <= radius * _ROUNDED < np.inf:
        raise InputError(
            f"a sphere of radius {radius:g} around the eye does not contain all points",
            hint=f"Use a radius larger than the distance of the farthest point, {farthest:g} away",
        )

    def shrink(distance: Floats, beyond: Floats, middle: float) -> Floats:
        return beyond / (2 * radius - middle) if radius > 0 else beyond

    return shrink


def hull_rows(seen: SeenPoints, kernel: Kernel) -> NDArray[np.intp]:
    """The rows (M,) whose flipped points are vertices of the hull with the eye, ascending.

    kernel: gives, for distances (N,), what they have beyond that of the middle (N,), and that of the middle,
    by how much the flipped length is shorter than the middle's, as a share of it; less than 1.
    """
    apart = np.flatnonzero(seen.distance > 0)
    others = seen[apart]
    rows = apart[_hull(others, kernel)] if len(apart) else apart
    return np.sort(np.append(rows, np.flatnonzero(seen.distance == 0)))


@dataclass(frozen=True, eq=False)
class LowerSide:
    """Flipped points as the gnomonic map has them, and the lower side of their hull.

    across: (N, 2), x / z and y / z. heights: (N,), 1 / z - 1. triangles: (T, 3), rows; those of N on are
    none of points.
    """

    across: Floats
    heights: Floats
    triangles: NDArray[np.intp]

    @classmethod
    def of(cls, seen: SeenPoints, kernel: Kernel) -> LowerSide | None:
        """The lower side, of points that are all ahead of the eye; None where they are not."""
        across = gnomonic(seen)
        if across is None:
            return None
        less = kernel(seen.distance, seen.beyond, float(np.linalg.norm(seen.middle)))
        squared = (across**2).sum(axis=1)
        heights = (squared / (1 + np.sqrt(1 + squared)) + less) / (1 - less)
        scaled = np.concatenate([_scaled(across), _scaled(heights[:, None])], axis=1)
        # Above all, in the middle, it makes a body of what is flat, and is no part of the lower side.
        above = np.append(scaled[:, :2].mean(axis=0), 5.0)
        beside = np.pad(_missing_axes(scaled[:, :2]), ((0, 0), (0, 1)), constant_values=2.0)
        beside[:, :2] += above[:2]
        body = np.concatenate([scaled, beside, above[None]])
        triangles = _triangles(body)
        first, second, third = (body[column, :2] for column in triangles.T)
        (x, y), (far_x, far_y) = (second - first).T, (third - first).T
        return cls(across, heights, triangles[x * far_y < y * far_x])


def gnomonic(seen: SeenPoints) -> Floats | None:
    """Positions (N, 2) of points in a picture at distance 1 whose middle is theirs; None if some are
    not ahead of the eye."""
    middle = float(np.linalg.norm(seen.middle))
    if middle == 0:
        return None
    ahead = seen.middle / middle
    along = seen.offsets @ ahead + middle
    if not (along > _AHEAD * seen.distance).all():
        return None
    right, up = _across(ahead)
    return np.stack([seen.offsets @ right, seen.offsets @ up], axis=1) / along[:, None]


def _hull(seen: SeenPoints, kernel: Kernel) -> NDArray[np.intp]:
    """Rows of the vertices, in any order; of points none of which is in the eye."""
    lower = LowerSide.of(seen, kernel)
    triangles = flipped_triangles(seen, kernel)[1] if lower is None else lower.triangles
    used = np.zeros(len(seen.distance), bool)
    used[triangles[triangles < len(used)]] = True
    return np.flatnonzero(used)


def flipped_triangles(seen: SeenPoints, kernel: Kernel) -> tuple[Floats, NDArray[np.intp]]:
    """Flipped points (N, 3), with lengths of about 1, and the triangles (T, 3) of their hull with the eye;
    rows of N on are none of points, the eye's is N. Exact to the rounding of these lengths."""
    less = kernel(seen.distance, seen.beyond, float(np.linalg.norm(seen.middle)))
    flipped = ((1 - less) / seen.distance)[:, None] * seen.away
    flipped /= np.abs(flipped).max()
    return flipped, _triangles(np.concatenate([flipped, np.zeros((1, 3)), _missing_axes(flipped)]))


def _triangles(scaled: Floats) -> NDArray[np.intp]:
    """The triangles (T, 3) of a convex hull, counterclockwise from outside."""
    from open3d import geometry, utility

    hull, rows = geometry.PointCloud(utility.Vector3dVector(scaled)).compute_convex_hull()
    return np.asarray(rows, np.intp)[np.asarray(hull.triangles)]


def _across(ahead: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors at right angles to one and to each other."""
    right = np.cross(ahead, np.eye(3)[np.argmin(np.abs(ahead))])
    right /= np.linalg.norm(right)
    return right, np.cross(ahead, right)


def _scaled(values: Floats) -> Floats:
    """Columns (N, C) moved and scaled alike, to -1 to 1; zeros where they are all the same."""
    low, high = values.min(axis=0), values.max(axis=0)
    half = float((high - low).max()) / 2
    return (values - (low + high) / 2) / (half or 1.0)


def _missing_axes(values: Floats) -> Floats:
    """Directions, to both sides, in which points (N, D) of size 1 have no extent: (2 M, D)."""
    _, sizes, axes = np.linalg.svd(values.T @ values)
    missing = axes[np.sqrt(sizes) <= _FLAT * max(np.sqrt(sizes[0]), 1.0)]
    return np.concatenate([missing, -missing])


# --- the radius -----------------------------------------------------------------------


def katz_radius(points: Pose | PointCloud | ArrayLike, eye: ArrayLike) -> float:
    """The radius with which most points are seen from one of two opposite eyes, and not from the other.

    Katz 2007: too small a sphere loses points that are seen, too large a one shows both eyes the same. Looked
    for from the distance to the farthest point to 10^5 times that, in steps of a quarter decade, and between
    these in finer ones. Slow: some sixty hulls. Raises InputError.
    """
    cloud = as_cloud(points)
    first = SeenPoints.of(cloud, eye)
    both = (first, SeenPoints.of(cloud, np.asarray(eye, np.float64) + 2 * first.middle))
    least = max(float(seen.distance.max(initial=0.0)) for seen in both)
    if least == 0:
        raise InputError("there are no points from which to compute the radius")

    def disjoint(decades: float) -> int:
        counts = np.zeros(len(cloud), np.uint8)
        for seen in both:
            counts[hull_rows(seen, flipping(seen, least * 10**decades))] += 1
        return int(np.count_nonzero(counts == 1))

    return least * 10 ** searched_decades(disjoint, 0.0, _DECADES)


def searched_decades(score: Callable[[float], float], low: float, high: float) -> float:
    """The number from `low` to `high` with the largest score: the best in steps of a quarter, and then in
    halves of these around it, thrice. What scores alike is told from the first."""
    found = np.arange(low, high + _COARSE / 2, _COARSE).tolist()
    known = {at: score(at) for at in found}
    best, step = max(known, key=lambda at: known[at]), _COARSE
    for _ in range(_FINE):
        step /= 2
        for at in (best - step, best + step):
            if low <= at <= high and at not in known:
                known[at] = score(at)
        best = max(known, key=lambda at: known[at])
    return best
