"""Measurements: the distance between two places that were picked, how sure it is, and where it goes in time.

An end snaps to the point of the scan that the picked pixel shows; where the pixel shows none, to the
surface. It is as uncertain as the scan is coarse there. A measurement follows its points from frame to frame
where the scan has one topology (`Timeline.one_topology`); else it stays where it was made.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from ..errors import InputError
from ..files import whole_file
from ..geometry import Vector
from ..rigid import STILL, Rigid
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..scan.spacing import nearest_row, spacing_at
from .pick import Picked

_DECIMALS = (-6, 12)  # that a number is written out with


@dataclass(frozen=True)
class End:
    """One end of a measurement.

    frame: the pose's index. time: the pose's, seconds. position: float64, scan units. snapped: to what.
    id: of the point, None on the surface. spacing: distance between the points around it, scan units,
    None where there are none: how uncertain `position` is as a place on the body. level: as of a `Picked`.
    """

    frame: int
    time: float
    position: Vector
    snapped: Literal["point", "surface"]
    id: int | None
    spacing: float | None
    level: int

    @classmethod
    def of(cls, picked: Picked, pose: Pose, *, filled: bool = False, place: Rigid = STILL) -> End:
        """The end at a place that was picked, with its spacing, in the picture of a pose that is moved to a
        place.

        filled: whether a place may be taken that no point shows. Such a place is at least as uncertain
        as the nearest point is far. Raises InputError for one where it may not.
        """
        if not (picked.measured or filled):
            hint = "Click where points are, or allow filled places"
            raise InputError("nothing was measured here, the hole is filled", hint=hint)
        if picked.point is not None:
            end, snapped, spacing = picked.point, "point", picked.spacing
        else:
            unmoved = place.inverse.points(picked.position)
            end, snapped, spacing = picked.position, "surface", _spacing_near(pose.around(unmoved), unmoved)
        x, y, z = (float(v) for v in end)
        return cls(pose.index, float(pose.time), (x, y, z), snapped, picked.id, spacing, picked.level)  # type: ignore[arg-type]


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
        """Uncertainty of the distance, scan units; None where an end's is unknown.

        Nothing is known between two points, so each end stands for the place that was meant up to the
        spacing there, in any direction. To first order, only what lies along the line changes the
        distance; the ends err independently, and independent errors add in squares: sqrt(s1^2 + s2^2).
        It speaks of the scan's sampling alone, not of the scanner's noise and calibration. A spacing is
        a cautious measure: a place anywhere in the cell of one point deviates by 0.28 spacings (1 sigma).
        """
        spacings = [end.spacing for end in self.ends]
        return None if None in spacings else math.hypot(*(s for s in spacings if s is not None))


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
    """The measurement in a pose: its ends at the places of their points there, or where they were.

    place: that the pose is moved to. one_topology: as the `Timeline` says. Spacings stay those of the frame
    in which it was made.
    """
    moved = []
    for end in measurement.ends:
        if end.id is None:
            return Reading(measurement, "an end is on the surface, not at a point")
        if end.frame != measurement.first.frame:
            return Reading(measurement, "its ends are of two frames")
        if not one_topology:
            return Reading(measurement, "the scan does not tell which points are the same in other frames")
        if (row := pose.cloud.row_of(end.id)) is None:
            return Reading(measurement, f"point {end.id} is missing in this frame")
        point = place.points(pose.cloud.world(row))
        x, y, z = (float(v) for v in point)
        moved.append(replace(end, frame=pose.index, time=float(pose.time), position=(x, y, z)))
    return Reading(Measurement(*moved), None)


def distance_in_words(distance: float, uncertainty: float | None, unit: str) -> str:
    """A distance with the digits that its uncertainty leaves it, such as "12.3 ± 0.4 mm"."""
    if not uncertainty:
        return f"{distance:.6g} {unit}"
    power = math.floor(math.log10(uncertainty))
    decimals = (
        -power if float(f"{uncertainty:.0e}") >= 2 * 10.0**power else 1 - power
    )  # two digits from 1.0 to 1.9
    if not _DECIMALS[0] <= decimals <= _DECIMALS[1]:
        return f"{distance:.6g} ± {uncertainty:.1g} {unit}"
    shown = (f"{round(value, decimals):.{max(decimals, 0)}f}" for value in (distance, uncertainty))
    return f"{' ± '.join(shown)} {unit}"


# --- as a table -----------------------------------------------------------------------------

_OF_END = ("frame", "time", "id", "x", "y", "z", "snapped", "spacing", "level")
COLUMNS = (
    "scan", "measurement", "distance", "uncertainty", "unit", "motion",
    *(f"{name}_{number}" for number in (1, 2) for name in _OF_END),
)  # fmt: skip


def table(readings: Sequence[tuple[int, Reading]], scan: str, unit: str) -> list[list[object]]:
    """A row of `COLUMNS` and one for each reading, with all digits; None: unknown.

    readings: a measurement's number and what it reads. Frames count from 1, as in the window.
    """
    return [list(COLUMNS), *(_row(number, reading, scan, unit) for number, reading in readings)]


def to_text(rows: Iterable[Iterable[object]], separator: str = ",") -> str:
    """The rows as RFC 4180 has them."""
    text = io.StringIO()
    csv.writer(text, delimiter=separator).writerows(rows)
    return text.getvalue()


def save_table(path: Path, rows: Iterable[Iterable[object]]) -> None:
    """Write the rows as a CSV file, in one step. Raises InputError where it cannot be written."""
    with whole_file(path) as temporary:
        temporary.write_text(to_text(rows), encoding="utf-8", newline="")


def _row(number: int, reading: Reading, scan: str, unit: str) -> list[object]:
    measurement = reading.measurement
    row = [scan, number, measurement.distance, measurement.uncertainty, unit, reading.motion]
    for end in measurement.ends:
        row += [end.frame + 1, end.time, end.id, *end.position, end.snapped, end.spacing, end.level]
    return row


def _spacing_near(cloud: PointCloud, position: np.ndarray) -> float | None:
    """The spacing at the point nearest to a place, or the distance to that point where it is more."""
    row, gap = nearest_row(cloud, position)
    spacing = spacing_at(cloud, row)
    return None if spacing is None else max(spacing, gap)
