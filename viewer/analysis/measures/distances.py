"""Distances between two landmarks, and the table that they are exported to and imported from.

A table has what a person needs, not all that a key of a landmark holds. Reading it finds the points that an
end follows again, and takes its covariance to be as wide in all directions as it was in the widest. So ± may
be wider than it was, never narrower.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from io import StringIO
from itertools import product
from pathlib import Path

import numpy as np

from ...csv_text import cell, text_of_cell
from ...errors import InputError
from ...files import open_plain, read_text, reading
from ...scan.pose import Pose
from ...scan.units import Scale, conversion
from ..landmarks import Landmark
from ..landmarks.placed import surface_point_at
from ..surface_point import SurfacePoint
from ..track import STATES, Known, Track
from ..words import SURE
from . import Measure, Series
from .series import series_of

_MOST_BYTES = 16 * 2**20  # of a table
_HINT = "Use an unchanged table that you saved with 'Export distances...'"
_OF_END = ("state", "point", "x", "y", "z", "uncertainty", "spacing", "level")
COLUMNS = (
    "scan", "measure", "frame", "time", "distance", "uncertainty", "unit",
    *(f"{name}_{number}" for number in (1, 2) for name in _OF_END),
)  # fmt: skip

Ends = tuple[tuple[SurfacePoint, ...], tuple[SurfacePoint, ...]]  # where each end was placed, by frame


def distance_of(one: SurfacePoint, other: SurfacePoint) -> tuple[float, float]:
    """The distance between two places and its standard deviation, scan units; NaN where one is unknown."""
    measure = Measure("", "distance", ("1", "2"))
    series = series_of(measure, {"1": Track.of(one), "2": Track.of(other)})
    return float(series.values[0]), float(series.sigmas[0])


# --- as a table -----------------------------------------------------------------------------


def distance_rows(
    measures: Iterable[Measure],
    landmarks: Mapping[str, Landmark],
    tracks: Mapping[str, Track],
    found: Mapping[str, Series],
    scan: str,
    scale: Scale,
    frames: Iterable[int],
) -> list[list[object]]:
    """The table of distances: a row of `COLUMNS`, then one for each distance and frame in which it is known
    or one of its ends was placed. None stands for what is unknown. Frames count from 1, as in the window.

    landmarks, tracks, found: by the name of the landmark or measure. scale: lengths are in its unit. frames:
    that are wanted.
    """
    rows: list[list[object]] = [list(COLUMNS)]
    for measure, frame in product(measures, frames):
        if (series := found.get(measure.name)) is not None:
            ends = [
                _end_cells(landmarks[name], tracks[name], frame, scale.factor) for name in measure.landmarks
            ]
            if series.known[frame] >= Known.TRACKED or STATES[Known.PLACED] in (end[0] for end in ends):
                value, sure = scale.factor * series.values[frame], SURE * scale.factor * series.sigmas[frame]
                head = scan, measure.name, frame + 1, float(series.times[frame])
                rows.append([*head, cell(value), cell(sure), scale.unit, *ends[0], *ends[1]])
    return rows


def _end_cells(landmark: Landmark, track: Track, frame: int, factor: float) -> list[object]:
    key = landmark.key_at(frame)
    spacing = None if key is None or key.spacing is None else factor * key.spacing
    lengths = (*track.positions[frame], SURE * track.sigmas[frame])
    return [
        STATES[Known(int(track.known[frame]))],
        None if key is None else key.id,
        *(cell(factor * length) for length in lengths),
        spacing,
        None if key is None else key.level,
    ]


def is_distance_table(path: Path) -> bool:
    """Whether a file is a table of distances, by its first line."""
    if path.suffix.lower() != ".csv":
        return False
    head = ",".join(COLUMNS).encode()
    try:
        with open_plain(path) as stream:
            return stream.read(len(head)) == head
    except OSError:
        return False


def read_distances(
    path: Path, scan: str, unit: str, count: int, pose_of: Callable[[int], Pose]
) -> dict[str, Ends]:
    """The distances of a table: name -> where both ends were placed.

    scan: its name, which all rows must have. unit: of the scan; lengths in another are converted. count: of
    the scan's frames. pose_of: gives one by its index. Raises InputError, with the line, for what cannot be
    used, and where no row is of the scan.
    """
    found: dict[str, tuple[list[SurfacePoint], list[SurfacePoint]]] = {}
    others = set()
    for where, row in _rows(path):
        if (name := text_of_cell(row["scan"])) != scan:
            others.add(name)
            continue
        factor = conversion(row["unit"], unit)
        if factor is None:
            what = f"the lengths are in '{row['unit']}', but the scan is in '{unit}'"
            raise InputError(what, where, "Set the scan unit in the panel, then import the table again")
        for number, points in enumerate(found.setdefault(text_of_cell(row["measure"]), ([], [])), 1):
            if row[f"state_{number}"] == STATES[Known.PLACED]:
                points.append(_surface_point(row, number, where, factor, count, pose_of))
    if others or not found:
        what = f"belongs to the scan '{min(others)}', not to '{scan}'" if others else "holds no distances"
        raise InputError(what, path, "Open that scan first" if others else _HINT)
    if unplaced := next((name for name, ends in found.items() if not all(ends)), None):
        raise InputError(f"has no position for one end of the distance '{unplaced}'", path, _HINT)
    return {name: (tuple(first), tuple(second)) for name, (first, second) in found.items()}


def _rows(path: Path) -> Iterator[tuple[str, Mapping[str, str]]]:
    """The rows of a table, each after its place in words. Raises InputError for what is no such table."""
    with reading(path, "is not a UTF-8 text", _HINT):
        text = read_text(path, _MOST_BYTES)
    rows = csv.DictReader(StringIO(text, newline=""), strict=True)
    try:
        for row in rows:
            where = f"{path}, line {rows.line_num}"
            if None in row or None in row.values() or not row.keys() >= set(COLUMNS):
                raise InputError("this row has too few or too many columns", where, _HINT)
            yield where, row
    except csv.Error as error:
        raise InputError(f"is not a table: {error}", f"{path}, line {rows.line_num}", _HINT) from error


def _surface_point(
    row: Mapping[str, str],
    number: int,
    where: str,
    factor: float,
    count: int,
    pose_of: Callable[[int], Pose],
) -> SurfacePoint:
    """Read the key of an end, with the points that it follows. factor: from the row's unit to the scan's."""

    def read(column: str) -> float:
        try:
            value = float(row[column])
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise InputError(f"'{column}' is not a number: '{row[column][:40]}'", where, _HINT)
        return value

    frame = read("frame")
    if not (frame == int(frame) and 1 <= frame <= count):
        raise InputError(f"'frame' is {frame:g}, but must be from 1 to {count}", where, _HINT)
    position = np.array([read(f"{axis}_{number}") for axis in "xyz"]) * factor
    sure = abs(read(f"uncertainty_{number}")) * factor if row[f"uncertainty_{number}"] else math.nan
    return surface_point_at(position, pose_of(int(frame) - 1), sure / SURE)
