"""Measurements: the distance between two places that were picked, how sure it is, and where it goes in time.

A measurement follows its points from frame to frame where the scan has one topology
(`Timeline.one_topology`), each end as a rigid body with the points around it; else it stays where it
was made.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..rigid import STILL, Rigid
from ..scan.pose import Pose
from ..task import checkpoint
from .pick import SURE, largest_deviation
from .spot import Spot, followed

_DECIMALS = (-6, 12)  # that a number is written out with
_COVERED = "(95 %)"  # of cases in which the true distance is within what ± says


@dataclass(frozen=True)
class Measurement:
    """A distance between two ends, in the order they were set."""

    first: Spot
    second: Spot

    @property
    def ends(self) -> tuple[Spot, Spot]:
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
        return "fixed in space" if self.fixed else "moves with the surface"


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
        if (moved_end := followed(end, pose, place)) is None:
            return Reading(measurement, f"point {end.id} is missing in this frame")
        moved.append(moved_end)
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
