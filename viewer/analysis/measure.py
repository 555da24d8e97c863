"""Measurements: the distance between two places that were picked, how sure it is, and where it goes in time.

An end is the place that was picked, not the nearest point. Its uncertainty is a covariance: of what the
points around leave open of the surface, of the pixel's size, and of what following the points adds. A
measurement follows its points from frame to frame where the scan has one topology (`Timeline.one_topology`),
each end as a rigid body with the points around it; else it stays where it was made.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import whole_file
from ..geometry import Vector, vector
from ..rigid import STILL, Rigid
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..scan.spacing import nearest_row, spacing_at
from ..task import checkpoint
from .pick import SURE, Neighbor, Picked, largest_deviation

_DECIMALS = (-6, 12)  # that a number is written out with
_COVERED = "(95 %)"  # of cases in which the true distance is within what ± says
_SLACK = 2.0, 1e-3  # spacings, and shares of the scan's size, that a surface is before what it hides
_SAME = 1e-14  # share of coordinates that rounding changes
_TURNING = 4  # points that tell how a place turns and how well they do


@dataclass(frozen=True)
class End:
    """One end of a measurement.

    frame: the pose's index. time: the pose's, seconds. position: float64, scan units. snapped: "point" where
    it is the very place of the point, as ends were once; else on the surface. id: of the point that is seen
    there, or of the nearest one, None where none is. spacing: distance between the points around it, scan
    units, None where there are none. level: as of a `Picked`. covariance: xx, xy, xz, yy, yz, zz of how the
    place that was meant may lie off the position, squared scan units; None: unknown. neighbors: points around
    it that it follows, and where they were when it was set. at_outline: as of a `Picked`.
    """

    frame: int
    time: float
    position: Vector
    snapped: Literal["point", "surface"]
    id: int | None
    spacing: float | None
    level: int
    covariance: tuple[float, float, float, float, float, float] | None = None
    neighbors: tuple[Neighbor, ...] = ()
    at_outline: bool = False

    @classmethod
    def of(cls, picked: Picked, pose: Pose, *, filled: bool = False, place: Rigid = STILL) -> End:
        """The end at a place that was picked, with its spacing, in the picture of a pose that is moved to a
        place.

        filled: whether a place may be taken that no point shows. Where the points around do not tell of a
        surface, the end is as uncertain as they are apart, or as the nearest is far. Raises InputError for a
        filled place where it may not be taken.
        """
        if not (picked.measured or filled):
            hint = "Click where points are, or allow filled places"
            raise InputError("nothing was measured here, the hole is filled", hint=hint)
        spacing, neighbors = picked.spacing, picked.neighbors
        if picked.point is None:
            unmoved = place.inverse.points(picked.position)
            spacing = _spacing_near(pose.around(unmoved), unmoved)
        elif not neighbors:
            assert picked.id is not None
            neighbors = (Neighbor(picked.id, vector(picked.point - picked.position)),)
        point, around = picked.id, [neighbor.id for neighbor in neighbors]
        if point is not None and point not in around:  # the place is on another surface, or beside the point
            point = around[0]
        covariance = picked.covariance
        if covariance is None and spacing is not None:
            beside = 0.0 if picked.point is None else float(np.linalg.norm(picked.point - picked.position))
            covariance = max(spacing, beside) ** 2 * np.eye(3)
        return cls(
            frame=pose.index,
            time=float(pose.time),
            position=picked.place,
            snapped="surface",
            id=point,
            spacing=spacing,
            level=picked.level,
            covariance=None if covariance is None else _six(covariance),
            neighbors=neighbors,
            at_outline=picked.at_outline,
        )

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


@dataclass(frozen=True)
class Measurement:
    """A distance between two ends, in the order they were set."""

    first: End
    second: End

    @property
    def ends(self) -> tuple[End, End]:
        """The two ends, first and second."""
        return self.first, self.second

    @property
    def distance(self) -> float:
        """Scan units."""
        return math.dist(self.first.position, self.second.position)

    @property
    def uncertainty(self) -> float | None:
        """Expanded uncertainty of the distance, scan units: it covers the true one in 95 % (k = 1.96). None
        where an end's is unknown, as of ends that an earlier version has set.

        To first order, only what lies along the line changes the distance; the ends err independently, so
        that their covariances add: k sqrt(u (C1 + C2) u), u the line's direction. Where the ends are not told
        apart, the direction is not known either, and the widest counts. It speaks of the scan's sampling and
        of the picture's pixels; a scanner's calibration comes on top.
        """
        one, other = self.first.spread, self.second.spread
        if one is None or other is None:
            return None
        spread, line = one + other, np.subtract(self.second.position, self.first.position)
        widest = largest_deviation(spread)
        if self.distance <= widest:
            return widest
        return SURE * math.sqrt(max(float(line @ spread @ line), 0.0)) / self.distance


@dataclass(frozen=True)
class Reading:
    """A measurement as it stands in one frame.

    fixed: why it does not follow its points there and stays in space, None where it follows them.
    """

    measurement: Measurement
    fixed: str | None

    @property
    def motion(self) -> str:
        """Movement and growth in time, in words."""
        return "fixed in space" if self.fixed else "follows points"


def reading_of(
    measurement: Measurement, pose: Pose, one_topology: bool | None, place: Rigid = STILL
) -> Reading:
    """The measurement in a pose: its ends where their points went, or where they were.

    place: that the pose is moved to. one_topology: as the `Timeline` says. Spacings stay those of the frame
    in which it was made; to the covariance comes what following leaves open.
    """
    moved = []
    for end in measurement.ends:
        if end.id is None:
            return Reading(measurement, "an end is on the surface, not at a point")
        if end.frame != measurement.first.frame:
            return Reading(measurement, "its ends are of two frames")
        if not one_topology:
            return Reading(measurement, "the scan does not tell which points are the same in other frames")
        if (followed := _followed(end, pose, place)) is None:
            return Reading(measurement, f"point {end.id} is missing in this frame")
        moved.append(followed)
    return Reading(Measurement(*moved), None)


def readings_in_frames(
    made: Sequence[Measurement], count: int, pose_of: Callable[[int], Pose], one_topology: bool | None
) -> list[tuple[int, Reading]]:
    """Each measurement by its number from 1: as it was made, then, where it follows its points, as it stands
    in each other frame, in their order.

    count: of frames. pose_of: gives one by its index. Frames that cannot be read are left out. A task that is
    cancelled ends it.
    """
    found: list[list[Reading]] = [[Reading(one, None)] for one in made]
    for index in range(count):
        checkpoint()
        try:
            pose = pose_of(index)
        except InputError:
            continue
        for readings, measurement in zip(found, made, strict=True):
            reading = reading_of(measurement, pose, one_topology)
            if index == measurement.second.frame or reading.fixed:
                readings[0] = Reading(measurement, reading.fixed)
            else:
                readings.append(reading)
    return [(number, reading) for number, readings in enumerate(found, 1) for reading in readings]


def _followed(end: End, pose: Pose, place: Rigid) -> End | None:
    """An end where its points are in a pose; None where the point that it was set at is missing."""
    assert end.id is not None
    neighbors = end.neighbors or (Neighbor(end.id, (0.0, 0.0, 0.0)),)
    rows = [pose.cloud.row_of(neighbor.id) for neighbor in neighbors]
    if pose.cloud.row_of(end.id) is None or all(row is None for row in rows):
        return None
    there = [(row, neighbor) for row, neighbor in zip(rows, neighbors, strict=True) if row is not None]
    now = place.points(pose.cloud.world(np.array([row for row, _ in there])))
    was = np.array(end.position) + np.array([neighbor.offset for _, neighbor in there])
    if np.abs(now - was).max() <= _SAME * np.abs(now).max():
        return replace(end, frame=pose.index, time=float(pose.time))
    position, turned, error = _carried(np.array(end.position), was, now)
    spread = end.spread
    if spread is not None:
        spread = turned @ spread @ turned.T + error**2 * np.eye(3)
    return replace(
        end,
        frame=pose.index,
        time=float(pose.time),
        position=vector(position),
        covariance=None if spread is None else _six(spread),
        neighbors=end.neighbors
        and tuple(
            Neighbor(neighbor.id, vector(point - position))
            for (_, neighbor), point in zip(there, now, strict=True)
        ),
    )


def _carried(
    position: NDArray[np.float64], was: NDArray[np.float64], now: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """A place that points (n, 3) carry with them as a rigid body would: where it is, how it is turned (3, 3),
    and the standard deviation of each of its coordinates, by how far the points are off such a motion.

    Fewer than four do not tell a turn and how good it is: the nearest alone is followed, at the same offset,
    which may have turned any way.
    """
    if len(was) < _TURNING:
        offset = position - was[0]
        return now[0] + offset, np.eye(3), float(np.linalg.norm(offset)) / math.sqrt(3)
    before, after = was.mean(axis=0), now.mean(axis=0)
    left, _, right = np.linalg.svd((now - after).T @ (was - before))  # Kabsch 1976
    turned = left @ np.diag([1, 1, np.sign(np.linalg.det(left @ right))]) @ right
    off = (now - after) - (was - before) @ turned.T
    free = 3 * len(was) - 6  # of the coordinates, six make the motion
    return after + turned @ (position - before), turned, math.sqrt(float((off**2).sum()) / free)


def end_slack(end: End, radius: float) -> float:
    """How far before an end the surface may be that is its own, scan units, for `is_seen`.

    radius: of the scan, scan units.
    """
    spacings, share = _SLACK
    return spacings * (end.spacing or 0) + share * radius + (end.uncertainty or 0)


def distance_in_words(distance: float, uncertainty: float | None, unit: str, factor: float = 1.0) -> str:
    """A distance with the digits that its uncertainty leaves it, such as "12.3 ± 0.4 mm (95 %)".

    unit, factor: that it is told in, and how many of it one unit of the scan is.
    """
    distance *= factor
    if not uncertainty:
        return f"{distance:.6g} {unit}"
    uncertainty *= factor
    power = math.floor(math.log10(uncertainty))
    decimals = (
        -power if float(f"{uncertainty:.0e}") >= 2 * 10.0**power else 1 - power
    )  # two digits from 1.0 to 1.9
    if not _DECIMALS[0] <= decimals <= _DECIMALS[1]:
        return f"{distance:.6g} ± {uncertainty:.1g} {unit} {_COVERED}"
    shown = (f"{round(value, decimals):.{max(decimals, 0)}f}" for value in (distance, uncertainty))
    return f"{' ± '.join(shown)} {unit} {_COVERED}"


# --- as a table -----------------------------------------------------------------------------

_OF_END = ("frame", "time", "id", "x", "y", "z", "snapped", "spacing", "level", "uncertainty")
COLUMNS = (
    "scan", "measurement", "distance", "uncertainty", "unit", "motion",
    *(f"{name}_{number}" for number in (1, 2) for name in _OF_END),
)  # fmt: skip


def table(
    readings: Sequence[tuple[int, Reading]], scan: str, unit: str, factor: float = 1.0
) -> list[list[object]]:
    """A row of `COLUMNS` and one for each reading, with all digits; None: unknown.

    readings: a measurement's number and what it reads. unit, factor: that lengths are told in, and how many
    of it one unit of the scan is. Frames count from 1, as in the window.
    """
    return [list(COLUMNS), *(_row(number, reading, scan, unit, factor) for number, reading in readings)]


def to_text(rows: Iterable[Iterable[object]], separator: str = ",") -> str:
    """The rows as RFC 4180 has them."""
    text = io.StringIO()
    csv.writer(text, delimiter=separator).writerows(rows)
    return text.getvalue()


def save_table(path: Path, rows: Iterable[Iterable[object]]) -> None:
    """Write the rows as a CSV file, in one step. Raises InputError where it cannot be written."""
    with whole_file(path) as temporary:
        temporary.write_text(to_text(rows), encoding="utf-8", newline="")


def _row(number: int, reading: Reading, scan: str, unit: str, factor: float) -> list[object]:
    def told(length: float | None) -> float | None:
        return None if length is None else factor * length

    measurement = reading.measurement
    row = [scan, number, told(measurement.distance), told(measurement.uncertainty), unit, reading.motion]
    for end in measurement.ends:
        row += [
            end.frame + 1,
            end.time,
            end.id,
            *map(told, end.position),
            end.snapped,
            told(end.spacing),
            end.level,
            told(end.uncertainty),
        ]
    return row


def _six(spread: NDArray[np.float64]) -> tuple[float, float, float, float, float, float]:
    xx, xy, xz, yy, yz, zz = spread[np.triu_indices(3)].tolist()
    return xx, xy, xz, yy, yz, zz


def _spacing_near(cloud: PointCloud, position: np.ndarray) -> float | None:
    """The spacing at the point nearest to a place, or the distance to that point where it is more."""
    row, gap = nearest_row(cloud, position)
    spacing = spacing_at(cloud, row)
    return None if spacing is None else max(spacing, gap)
