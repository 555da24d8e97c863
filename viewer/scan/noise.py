"""Noise: how far points lie off the surface that they are samples of, and points without it.

The nearest neighbours of some points tell the noise: their distances to a quadric, since a plane would take
bends of the surface for noise. So many neighbours are used that they reach several times as far as the noise.
`steadied` moves points to planes through those around, weighted by a B-spline (moving least squares,
Alexa 2003).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .copies import distinct_rows
from .points import PointCloud
from .spacing import nearest_rows

_LOOKED_AT = 8_000_000  # distances from point to point that tell of noise
_POSITIONS = (8, 64)  # at least and at most, where it is looked for
_NEAREST = (16, 64, 256, 1024, 4096)  # points there, of which the fewest that reach far enough are taken
_NEAR = 0.25  # of how far they reach: the most noise that they tell
_TERMS = 6  # of a quadric
_DETAIL = 0.16  # in distances between points: up to that, it may be detail of the surface
_CELLS = (2.5, 2.6)  # the edge of those that are averaged, in distances between points and in deviations
_OUTLIERS = 0.5  # deviation, in distances between points, from which on some need a second time
_FARTHEST = 4.0  # deviations that a point is moved at most, each time
_ENOUGH = 2.0  # points, by their weights, that tell a plane
_MOST_CELLS = 1 << 20  # to each side of the middle; what lies farther off stays where it is


@dataclass(frozen=True)
class Noise:
    """Noise of a cloud.

    deviation: standard deviation of the distances of points from their surface. spacing: distance between
    neighbours. Both in scan units.
    """

    deviation: float
    spacing: float

    @property
    def stands_out(self) -> bool:
        """Whether it is more than may be detail of the surface."""
        return self.deviation > _DETAIL * self.spacing


_NONE = Noise(0.0, 0.0)


def noise_of(cloud: PointCloud) -> Noise:
    """The noise of a cloud: the median at some positions, found once. Few points have none."""
    return cloud.remember(_noise)


def known_noise(cloud: PointCloud) -> Noise | None:
    """The noise of a cloud where it was found before, on any thread; else None, at once."""
    return cloud.recall(_noise)


def _noise(cloud: PointCloud) -> Noise:
    noise = _NONE
    if not len(cloud):
        return noise
    rows = _sample_rows(cloud)
    for nearest in _NEAREST:
        if 2 * nearest > len(cloud):
            break
        near = [_exact(cloud, found) for found in nearest_rows(cloud, rows, nearest)]
        if nearest == _NEAREST[0] and any(len(np.unique(points, axis=0)) < nearest for points in near):
            return _noise_of_distinct(cloud)
        shares, reaches = np.array([_off_quadric(points) for points in near]).T
        spacing = float(np.median(reaches)) * float(np.sqrt(np.pi / nearest))
        noise = Noise(float(np.median(shares * reaches)), spacing)
        if np.median(shares) < _NEAR:
            break
    return noise


def _noise_of_distinct(cloud: PointCloud) -> Noise:
    """The noise of the positions of a cloud, each of them once: copies of a point would hide it.

    The positions stay in order, so that copies do not change the result.
    """
    rows = np.sort(distinct_rows(_exact(cloud, slice(None)))[0])
    remainders = None if cloud.remainders is None else cloud.remainders[rows]
    return _noise(PointCloud(positions=cloud.positions[rows], origin=cloud.origin, remainders=remainders))


def _exact(cloud: PointCloud, rows: NDArray[np.intp] | slice) -> NDArray[np.float64]:
    """Positions of rows relative to the cloud's origin, (R, 3), with what float32 rounds off far from it."""
    points = cloud.positions[rows].astype(np.float64)
    return points if cloud.remainders is None else points + cloud.remainders[rows]


def _sample_rows(cloud: PointCloud) -> list[int]:
    """The rows at which neighbours are looked at."""
    count = min(max(_LOOKED_AT // len(cloud), _POSITIONS[0]), _POSITIONS[1])
    return np.linspace(0, len(cloud) - 1, count).astype(int).tolist()


def _off_quadric(points: NDArray[np.float64]) -> tuple[float, float]:
    """How far points (N, 3) lie off the quadric through them, in shares of how far they reach; and that."""
    away = points - points.mean(axis=0)
    reach = float(np.sqrt((away * away).sum(axis=1).max()))
    if reach == 0:
        return 0.0, 0.0
    away /= reach
    x, y, z = np.linalg.svd(away, full_matrices=False)[2] @ away.T
    terms, _ = np.linalg.qr(np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1))
    off = z - terms @ (terms.T @ z)
    return float(np.sqrt((off * off).sum() / (len(points) - _TERMS))), reach


class SteadyPoints(NamedTuple):
    """Points with less noise.

    positions: (N, 3) float32, relative to the cloud's origin. normals: (N, 3) float32, of the planes that the
    points moved to, either side up; 0 where too few points lie around.
    """

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]


def steady_positions(cloud: PointCloud, noise: Noise) -> NDArray[np.float32]:
    """Points of a cloud with less of its noise, (N, 3), relative to its origin."""
    return steadied(cloud, noise).positions


def steadied(cloud: PointCloud, noise: Noise) -> SteadyPoints:
    """The points of a cloud on planes through the points around."""
    edge = float(np.hypot(_CELLS[0] * noise.spacing, _CELLS[1] * noise.deviation))
    points = _exact(cloud, slice(None))
    farthest, times = _FARTHEST * noise.deviation, 2 if noise.deviation > _OUTLIERS * noise.spacing else 1
    for _ in range(times):
        points, normals = _moved_to_planes(points, edge, farthest)
    # Planes lie inside round bodies. One more move shows how far, and is taken back for each move before.
    inside, _ = _moved_to_planes(points, edge, farthest)
    points += times * (points - inside)
    return SteadyPoints(points.astype(np.float32), normals.astype(np.float32))


def _moved_to_planes(
    points: NDArray[np.float64], edge: float, farthest: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points moved to the planes of those around, and the normals of these, both (N, 3). edge: of cells, a
    third of how far the B-spline reaches."""
    from .noise_kernels import move_to_planes

    in_cells = (points - np.median(points, axis=0)) / edge + _MOST_CELLS
    rows = np.flatnonzero(((in_cells > 1) & (in_cells < 2 * _MOST_CELLS - 1)).all(axis=1))
    cells = np.floor(in_cells[rows]).astype(np.int64)
    codes = (cells[:, 0] << 42) + (cells[:, 1] << 21) + cells[:, 2]
    order = codes.argsort(kind="stable")
    firsts = np.flatnonzero(np.diff(codes[order], prepend=-1, append=-1))
    planes = np.zeros((len(points), 6))
    move_to_planes(in_cells, rows[order], firsts, codes[order][firsts[:-1]], _ENOUGH, farthest / edge, planes)
    return points + edge * planes[:, :3], planes[:, 3:]
