"""Measurements read back from the table that they were saved as.

A table has what a person needs, not all that a measurement holds: the points that an end follows are looked
up in its frame, and its covariance is as wide in all directions as it was in the widest, so that ± may be
wider than it was, never narrower.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Literal

import numpy as np

from ..csv_text import text_of_cell
from ..errors import InputError, explained
from ..files import open_plain, read_text
from ..geometry import vector
from ..scan.pose import Pose
from ..scan.units import conversion
from .measure import COLUMNS, Measurement
from .pick import FOLLOWED, SURE, Neighbor
from .spot import Spot

_MOST_BYTES = 16 * 2**20  # of a table
_HINT = "Use a table that 'Save CSV...' has written, unchanged"


def is_measurement_table(path: Path) -> bool:
    """Whether a file is a table of measurements, by its first line."""
    if path.suffix.lower() != ".csv":
        return False
    head = ",".join(COLUMNS).encode()
    try:
        with open_plain(path) as stream:
            return stream.read(len(head)) == head
    except OSError:
        return False


def read_measurements(
    path: Path, scan: str, unit: str, count: int, pose_of: Callable[[int], Pose]
) -> tuple[Measurement, ...]:
    """The measurements of a table, each as it was made.

    scan: its name, which all rows must have. unit: of the scan; lengths in another are converted. count: of
    the scan's frames. pose_of: gives one by its index. Raises InputError, with the line, for what cannot be
    used, and where no row is of the scan.
    """
    try:
        text = read_text(path, _MOST_BYTES)
    except OSError as error:
        what, hint = explained(error)
        raise InputError(f"cannot be read: {what}", path, hint) from error
    except UnicodeDecodeError as error:
        raise InputError("is no text in UTF-8", path, _HINT) from error
    rows = csv.DictReader(StringIO(text, newline=""), strict=True)
    found: dict[str, Measurement] = {}
    others = set()
    try:
        for row in rows:
            where = f"{path}, line {rows.line_num}"
            if None in row or None in row.values() or not row.keys() >= set(COLUMNS):
                raise InputError("a column is missing, or one too many", where, _HINT)
            if (name := text_of_cell(row["scan"])) != scan:
                others.add(name)
            elif row["measurement"] not in found:  # further rows: how it stands in other frames
                found[row["measurement"]] = _measurement(row, where, unit, count)
    except csv.Error as error:
        raise InputError(f"is no table: {error}", f"{path}, line {rows.line_num}", _HINT) from error
    if others or not found:
        told = f"is of '{min(others)}', not of '{scan}'" if others else "holds no measurements"
        raise InputError(told, path, "Open that scan first" if others else _HINT)
    return tuple(
        Measurement(*(_with_points(end, pose_of(end.frame)) for end in measurement.ends))
        for measurement in found.values()
    )


def _measurement(row: Mapping[str, str], where: str, unit: str, count: int) -> Measurement:
    factor = conversion(row["unit"], unit)
    if factor is None:
        what = f"lengths are in '{row['unit']}', those of the scan in '{unit}'"
        raise InputError(what, where, "Set the scan's unit in the panel first")
    return Measurement(_end(row, "1", where, factor, count), _end(row, "2", where, factor, count))


def _end(row: Mapping[str, str], number: str, where: str, factor: float, count: int) -> Spot:
    """An end without the points that it follows. factor: of its lengths to the scan's."""

    def read(name: str) -> float:
        text = row[f"{name}_{number}"]
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise InputError(f"'{name}_{number}' is no number but '{text[:40]}'", where, _HINT)
        return value

    def whole(name: str, low: int, high: int) -> int:
        value = read(name)
        if not (value == int(value) and low <= value <= high):
            what = f"'{name}_{number}' is {value:g}, and not from {low} to {high}"
            raise InputError(what, where, _HINT)
        return int(value)

    def length(name: str) -> float | None:
        return abs(read(name)) * factor if row[f"{name}_{number}"] else None

    snapped: Literal["point", "surface"] = "point" if row[f"snapped_{number}"] == "point" else "surface"
    sure = length("uncertainty")
    variance = 0.0 if sure is None else (sure / SURE) ** 2
    return Spot(
        frame=whole("frame", 1, count) - 1,
        time=read("time"),
        position=vector(np.array([read(axis) for axis in "xyz"]) * factor),
        snapped=snapped,
        id=whole("id", 0, 2**32 - 2) if row[f"id_{number}"] else None,
        spacing=length("spacing"),
        level=whole("level", 0, 254),
        covariance=None if sure is None else (variance, 0.0, 0.0, variance, 0.0, variance),
    )


def _with_points(end: Spot, pose: Pose) -> Spot:
    """The end with the points of its frame that are nearest to it, its own first, where it follows one."""
    row = None if end.id is None else pose.cloud.row_of(end.id)
    if end.snapped == "point" or end.id is None or row is None:
        return end
    offsets = pose.cloud.world() - np.array(end.position)
    away = np.einsum("ij,ij->i", offsets, offsets)
    few = min(FOLLOWED, len(away))
    nearest = np.argpartition(away, few - 1)[:few]
    rows = [row, *(int(other) for other in nearest[np.argsort(away[nearest], kind="stable")] if other != row)]
    ids = rows if pose.cloud.ids is None else pose.cloud.ids[rows].tolist()
    neighbors = tuple(
        Neighbor(id, vector(offset)) for id, offset in zip(ids[:few], offsets[rows[:few]], strict=True)
    )
    return replace(end, neighbors=neighbors)
