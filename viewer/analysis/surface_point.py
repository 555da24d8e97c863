"""Surface points: picked positions, how sure they are, and how the points around carry them through time.

A surface point is the position that was picked, not the nearest point of the scan. Its uncertainty is a
covariance: of what the points around leave open of the surface, of the pixel's size, and of what tracking
adds. Where a scan has one topology (`PointCloud.topology`), a surface point moves with the points around it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..geometry import Vector, vector
from ..rigid import STILL, Rigid, best_rotation
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..scan.spacing import nearest_row, spacing_at
from .pick import Neighbor, Picked, largest_deviation

_SLACK = 2.0, 1e-3  # spacings, and shares of the scan's size, that a surface is before what it hides
_SAME = 1e-14  # share of coordinates that rounding changes
_FLAT = 0.1  # of how far points reach along a line, that they reach across it where they have a plane
_TURNING = 4  # points that tell how a place turns and how well they do


class UncertainPosition(InputError):
    """A picked position that is not clearly on a measured surface. accepted_by: the argument of
    `SurfacePoint.of` that accepts it."""

    def __init__(self, what: str, accepted_by: Literal["filled", "doubtful"]) -> None:
        super().__init__(what, hint=f"Pass {accepted_by}=True to accept the position")
        self.accepted_by = accepted_by


@dataclass(frozen=True)
class SurfacePoint:
    """A position on the surface that was picked in a frame, such as an end of a distance.

    frame: the pose's index. time: the pose's, seconds. position: float64, scan units. id: of the point that
    is seen there, or of the nearest one, None where none is. spacing: distance between the points around
    it, scan units, None where there are none. level: as of a `Picked`. covariance: xx, xy, xz, yy, yz, zz
    of how the place that was meant may lie off the position, squared scan units; None: unknown. neighbors:
    points around it that it follows, and where they were when it was set. at_outline: as of a `Picked`.
    averaged: frames that the points around are means of at most, 0: they are as scanned.
    """

    frame: int
    time: float
    position: Vector
    id: int | None
    spacing: float | None
    level: int
    covariance: tuple[float, float, float, float, float, float] | None = None
    neighbors: tuple[Neighbor, ...] = ()
    at_outline: bool = False
    averaged: int = 0

    @classmethod
    def of(
        cls,
        picked: Picked,
        pose: Pose,
        *,
        filled: bool = False,
        doubtful: bool = False,
        place: Rigid = STILL,
    ) -> SurfacePoint:
        """The surface point that was picked, with its spacing, in scan coordinates. place: the motion by
        which the picture shows the pose.

        filled: whether a place may be taken that no point shows, also where it is not between points of one
        surface that lie a few spacings away. Where the points around do not tell of a
        surface, it is as uncertain as they are apart, or as the nearest is far. doubtful: whether a place
        may be taken where another surface may be meant (`Picked.at_outline`). Raises UncertainPosition for
        a filled or doubtful place where it may not be taken.
        """
        if not (picked.measured or picked.between or filled):
            raise UncertainPosition(
                "there are no measured points here, because the renderer has filled a hole", "filled"
            )
        if picked.at_outline and not doubtful:
            raise UncertainPosition(
                f"this position may be on the surface in front or behind ({picked.doubt:.0%})", "doubtful"
            )
        spacing, neighbors = picked.spacing, picked.neighbors
        if picked.point is None:
            unmoved = place.inverse.points(picked.position)
            spacing = _spacing_near(pose.around(unmoved), unmoved)
        elif not neighbors:
            assert picked.id is not None
            neighbors = (Neighbor(picked.id, vector(picked.point - picked.position)),)
        id, around = picked.id, [neighbor.id for neighbor in neighbors]
        if id is not None and id not in around:  # the position is on another surface, or beside the point
            id = around[0]
        covariance = picked.covariance
        if covariance is None and spacing is not None:
            beside = 0.0 if picked.point is None else float(np.linalg.norm(picked.point - picked.position))
            covariance = max(spacing, beside) ** 2 * np.eye(3)
        point = cls(
            frame=pose.index,
            time=float(pose.time),
            position=picked.place,
            id=id,
            spacing=spacing,
            level=picked.level,
            covariance=None if covariance is None else _six(covariance),
            neighbors=neighbors,
            at_outline=picked.at_outline,
            averaged=0 if pose.average is None else pose.average.frames,
        )
        return _moved(point, place.inverse)

    @property
    def spread(self) -> NDArray[np.float64] | None:
        """The covariance as a matrix, (3, 3)."""
        if self.covariance is None:
            return None
        xx, xy, xz, yy, yz, zz = self.covariance
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    @property
    def uncertainty(self) -> float | None:
        """How far off the position the place that was meant is at most, along any one line, with 95 %; scan
        units. None where it is unknown."""
        return None if (spread := self.spread) is None else largest_deviation(spread)


def followed(point: SurfacePoint, pose: Pose) -> SurfacePoint | None:
    """A surface point in a pose of the same topology, where the points around it are; None where its own
    point is missing.

    To the covariance comes what following leaves open."""
    if point.id is None:
        return None
    neighbors = point.neighbors or (Neighbor(point.id, (0.0, 0.0, 0.0)),)
    rows = [pose.cloud.row_of(neighbor.id) for neighbor in neighbors]
    if pose.cloud.row_of(point.id) is None or all(row is None for row in rows):
        return None
    there = [(row, neighbor) for row, neighbor in zip(rows, neighbors, strict=True) if row is not None]
    now = pose.cloud.world(np.array([row for row, _ in there]))
    was = np.array(point.position) + np.array([neighbor.offset for _, neighbor in there])
    if np.abs(now - was).max() <= _SAME * np.abs(now).max():
        return replace(point, frame=pose.index, time=float(pose.time))
    position, turned, error = _carried(np.array(point.position), was, now)
    spread = point.spread
    if spread is not None:
        spread = turned @ spread @ turned.T + error**2 * np.eye(3)
    return replace(
        point,
        frame=pose.index,
        time=float(pose.time),
        position=vector(position),
        covariance=None if spread is None else _six(spread),
        neighbors=point.neighbors
        and tuple(
            Neighbor(neighbor.id, vector(position_now - position))
            for (_, neighbor), position_now in zip(there, now, strict=True)
        ),
    )


def _carried(
    position: NDArray[np.float64], was: NDArray[np.float64], now: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """A place that points (n, 3) carry with them: where it is, how it is turned (3, 3), and the standard
    deviation of each of its coordinates, by how far the points are off the motion of a rigid body.

    It stays at the same mean of the points where it lies among them (`_shares`), so that it goes along with
    a surface that stretches; what it is off that mean is turned as a rigid body would be. Fewer than four do
    not tell a turn and how good it is: that offset may have turned any way.
    """
    shares = _shares(position, was)
    if len(was) < _TURNING:
        offset = position - shares @ was
        return shares @ now + offset, np.eye(3), float(np.linalg.norm(offset)) / math.sqrt(3)
    before, after = was.mean(axis=0), now.mean(axis=0)
    turned = best_rotation(was - before, now - after)
    off = (now - after) - (was - before) @ turned.T
    free = 3 * len(was) - 6  # of the coordinates, six make the motion
    placed = shares @ now + turned @ (position - shares @ was)
    return placed, turned, math.sqrt(float((off**2).sum()) / free)


def _shares(position: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The weights of points (n, 3) whose mean is the place nearest to a position in their plane, (n,), the
    evenest of these. Where the position lies beside them, or they have no plane: even ones, or the first's
    alone where they do not tell a turn."""
    count, offsets = len(points), points - points.mean(axis=0)
    usual = np.full(count, 1 / count) if count >= _TURNING else np.eye(count)[0]
    _, widths, axes = np.linalg.svd(offsets, full_matrices=False)
    if count < 3 or not widths[1] > _FLAT * widths[0]:
        return usual
    rows = np.column_stack([offsets @ axes[:2].T / widths[0], np.ones(count)])
    wanted = np.append(axes[:2] @ (position - points.mean(axis=0)) / widths[0], 1.0)
    shares = np.linalg.lstsq(rows.T, wanted, rcond=None)[0]
    return shares if shares @ shares <= 1 else usual  # else errors of points would grow


def _moved(point: SurfacePoint, motion: Rigid) -> SurfacePoint:
    if motion.is_identity:
        return point
    spread = point.spread
    return replace(
        point,
        position=vector(motion.points(np.array(point.position))),
        covariance=None if spread is None else _six(motion.rotation @ spread @ motion.rotation.T),
        neighbors=tuple(
            Neighbor(one.id, vector(motion.rotation @ np.array(one.offset))) for one in point.neighbors
        ),
    )


def slack_before(
    spacing: NDArray[np.float64] | float, sure: NDArray[np.float64] | float, radius: float
) -> NDArray[np.float64] | float:
    """How far before places the surface may be that is their own, scan units.

    spacing: of the points around each. sure: how far off it is at most. radius: of the scan.
    """
    spacings, share = _SLACK
    return spacings * spacing + share * radius + sure


def _six(spread: NDArray[np.float64]) -> tuple[float, float, float, float, float, float]:
    xx, xy, xz, yy, yz, zz = spread[np.triu_indices(3)].tolist()
    return xx, xy, xz, yy, yz, zz


def _spacing_near(cloud: PointCloud, position: np.ndarray) -> float | None:
    """The spacing at the point nearest to a place, or the distance to that point where it is more."""
    row, gap = nearest_row(cloud, position)
    spacing = spacing_at(cloud, row)
    return None if spacing is None else max(spacing, gap)
