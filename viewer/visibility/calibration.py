"""EyeCalibration: radius, number of sectors and steps from how densely points lie, as the eye sees them.

Machado e Silva 2014, 6.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..picture.sample import lots
from ..scan.points import NOTHING, PointCloud, strided
from ..view import View
from .sectors import Sectors

_OCCUPIED = 0.5  # of the sectors inside the object's outline: a of eq. 5
_COARSE = 64  # cells along an edge of the coarse map
_PARTS = 4  # steps in which the edge doubles: small changes of a scan leave it
_NEAREST = 0.02  # share of the points
_LEAST = 1 / 16  # of the usual distance: gaps between nearer points stay open
_EYE_BITS = 36  # of an eye's position
_ROOM = 1 + 1e-5  # so that rounding puts no point of the sphere outside the grid


@dataclass(frozen=True)
class Body:
    """The body of a scan. center: (3,) scan units, the mean of the points; radius: of the sphere around it
    that has them all, far outliers aside. count: of the points that differ."""

    center: NDArray[np.float64]
    radius: float
    count: int


def body_of(cloud: PointCloud) -> Body:
    """The body of a cloud that has points; found once."""
    return cloud.remember(_body)


def _body(cloud: PointCloud) -> Body:
    bounds = cloud.bounds()
    low, high = (bounds.low - cloud.origin), (bounds.high - cloud.origin)
    inside = ((cloud.positions >= low) & (cloud.positions <= high)).all(axis=1)
    points = cloud.positions if inside.all() or not inside.any() else cloud.positions[inside]
    center = points.mean(axis=0, dtype=np.float64)
    away = points - center.astype(np.float32)
    radius = math.sqrt(float(np.einsum("ij,ij->i", away, away).max()))
    least = float(np.abs(points).max()) * 1e-6 or 1.0  # of points that all coincide
    return Body(center + cloud.origin, max(radius, least) * _ROOM, _distinct(cloud.positions))


def directions_of(cloud: PointCloud, origin: NDArray[np.float64], view: View) -> tuple[Sectors, Body]:
    """How directions from a view's eye are divided, and the body that it sees. origin: (3,), what positions
    of the cloud are relative to on the GPU."""
    body = body_of(cloud)
    if view.perspective:
        eye = _snapped(view.eye, body)
        return Sectors.around(body.center, body.radius, eye, origin), body
    return Sectors.along(body.center, body.radius, -view.rotation[2], origin), body


def _snapped(eye: NDArray[np.float64], body: Body) -> NDArray[np.float64]:
    """The eye without what rounding makes of it when the camera turns."""
    away = eye - body.center
    step = 2.0 ** (math.ceil(math.log2(max(float(np.abs(away).max()), body.radius))) - _EYE_BITS)
    return body.center + np.round(away / step) * step


def copies(cloud: PointCloud) -> NDArray[np.uint32]:
    """The first of `lots` of the points of lower rows at each point's position, (N,); NOTHING: it has none.

    So that it is told whether a sample has one: where that lot is below the sample's share of 2^32.
    """
    words = _words(cloud.positions)
    order = words.argsort(kind="stable")
    again = words[order[1:]] == words[order[:-1]]
    group = np.concatenate(([0], np.cumsum(~again)))
    # Positions of higher numbers have less in the upper half: there the least begins anew.
    lot = np.minimum(lots(order.astype(np.uint32)), NOTHING - 1) | (group[-1] - group).astype(np.uint64) << 32
    least = np.minimum.accumulate(lot).astype(np.uint32)
    found = np.full(len(words), NOTHING, np.uint32)
    found[order[1:][again]] = least[:-1][again]
    return found


def _distinct(positions: NDArray[np.float32]) -> int:
    words = _words(positions)
    words.sort()
    return 1 + int(np.count_nonzero(words[1:] != words[:-1]))


def _words(positions: NDArray[np.float32]) -> NDArray[np.uint64]:
    """A word for each point, the same for points that coincide and for next to no others."""
    words = (positions + np.float32(0)).view(np.uint32).astype(np.uint64)  # + 0: no negative zero
    mixed = words[:, 0] * np.uint64(0x9E3779B97F4A7C15)
    mixed = (mixed ^ mixed >> np.uint64(29)) + words[:, 1] * np.uint64(0xBF58476D1CE4E5B9)
    return (mixed ^ mixed >> np.uint64(32)) + words[:, 2] * np.uint64(0x94D049BB133111EB)


class SectorSearch(NamedTuple):
    """A search for visible points. sectors: how directions are divided. steps: of propagation, which close
    the gaps between visible points. stride: sectors between those whose candidates are compared with a
    point; 0: none is."""

    sectors: Sectors
    steps: int
    stride: int


@dataclass(frozen=True)
class EyeCalibration:
    """Sectors and flip that suit a cloud as one eye sees it.

    sectors: so many that half of those inside the outline have a point, with the weight of `radius`. radius:
    R of the flip, scan units, infinite for parallel rays. occupied: share of all directions of the sectors
    that the object takes. spacing: usual angle between neighbouring visible points, in sectors of these.
    """

    sectors: Sectors
    radius: float
    occupied: float
    spacing: float

    def with_sectors(self, edge: int) -> SectorSearch:
        """The search in sectors of these directions, so many along an edge."""
        finer = edge / self.sectors.edge
        sectors = self.sectors.divided(edge)
        # A little short does: points are compared with the candidates around as well.
        steps = max(int(self.spacing * finer + 0.4), 1)
        return SectorSearch(sectors, steps, math.ceil(finer))


def calibrate(
    cloud: PointCloud,
    sectors: Sectors,
    origin: NDArray[np.float64],
    depth: float,
    radius: float | None = None,
    drawn: float = 1.0,
) -> EyeCalibration:
    """The calibration for a cloud that has points.

    sectors: how directions are divided, by any number. origin: what they take positions relative to, (3,).
    depth: a point hides others that lie so much farther away behind it, in units of the sectors: d of the
    paper. radius: R, scan units; None: from `depth`. drawn: share of the points that are looked at.
    """
    coarse = sectors.divided(_COARSE)
    sample = strided(cloud.positions).T.astype(np.float64, order="C")
    sample += (cloud.origin - origin)[:, None]
    sector_positions = coarse.sector_positions(sample.T)
    has_point = np.zeros(coarse.count + 1, bool)
    has_point[np.minimum(coarse.sector_of(sector_positions), coarse.count)] = True  # the last one: in none
    share = max(int(np.count_nonzero(has_point[:-1])), 1) / coarse.count
    count = max(body_of(cloud).count * drawn, 1.0)
    inside = -1 / math.expm1(math.log1p(-_OCCUPIED) / count)  # eq. 5
    wanted = math.sqrt(inside / share * coarse.edge**2 / coarse.count)
    edge = max(round(2 ** (round(_PARTS * math.log2(wanted)) / _PARTS)), 1)
    found = sectors.divided(edge)
    spacing = math.sqrt(2 * inside / count)  # half of the points are seen
    apart = 2 * found.angle  # alpha
    if math.isinf(found.distance):
        return EyeCalibration(found.weighted(4 * depth / apart), math.inf, share, spacing)
    is_known = np.isfinite(sector_positions[:, 2])
    distances = found.distances(sector_positions if is_known.all() else sector_positions[is_known])
    surface = float(distances.mean()) if len(distances) else found.unit
    if len(distances):  # near points lie farther apart
        spacing *= surface / max(float(np.quantile(distances, _NEAREST)), _LEAST * surface)
    if radius is None:
        radius = surface * (0.5 + depth * apart / (4 * math.sin(apart / 4) ** 2))
        radius = max(radius, found.farthest)
    return EyeCalibration(found.flipped(radius), radius, share, spacing)
