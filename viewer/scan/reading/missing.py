"""Which values mean "not measured": points at (0, 0, 0) or (-1, -1, -1), numbers such as -9999 or 65504.

Scanners and exporters write them for pixels that saw nothing. A value counts only where many points share
it and nothing else lies near it, so that a real point at the origin stays. A point with a coordinate that is
not finite never counts as measured.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..points import NOT_FINITE, strided
from .corrections import NOTHING_CORRECTED, Corrections
from .record import Decision
from .sequence import Decided

KEY = "missing"
_PLACES = {"0 0 0": 0, "-1 -1 -1": -1}  # by their names in the record: x, y and z of points not measured
NONE = "none"  # the correction that retains all points
_LEAST = 8  # points that share a value
_SHARE = 0.02  # of the points, at one of the places
_FAR = 10.0  # spacings from the place to the nearest measured point
SENTINELS = (9999.0, -999.0, -9999.0, 32767.0, -32768.0, 65504.0, 65535.0, 99999.0, -99999.0)
_HUGE = 1e10  # renderers write this and more where a ray hits nothing


class Unmeasured(NamedTuple):
    """Rows that were not measured. value: what marks them, as the record names it. rows: (N,) bool."""

    value: str
    rows: NDArray[np.bool_]


def unmeasured_points(points: NDArray) -> Unmeasured | None:
    """The rows of points (N, 3) that were not measured; None where there are none."""
    for place, coordinate in _PLACES.items():
        rows = _rows_at_place(points, coordinate)
        if rows is not None:
            return Unmeasured(place, rows)
    depth = points[:, 2]
    value = unmeasured_value(depth)
    if value is not None:
        return Unmeasured(f"{value:g}", depth == depth.dtype.type(value))
    return _sentinel_rows(points) if len(points) else None


def _sentinel_rows(points: NDArray) -> Unmeasured | None:
    """The rows of points (N, 3) whose x, y and z are one such number, however few, if it lies far away."""
    depth = points[:, 2]
    for value in {float(depth.min()), float(depth.max())} & {*SENTINELS}:
        rows = (points == points.dtype.type(value)).all(axis=1)
        others = depth[~rows]
        if rows.any() and others.size and abs(value - others).min() > np.ptp(others):
            return Unmeasured(f"{value:g}", rows)
    return None


def _rows_at_place(points: NDArray, coordinate: int) -> NDArray[np.bool_] | None:
    """The rows of points (N, 3), (N,) bool, whose x, y and z are this number, if not measured, else None.

    They are at least 8 and 2 % of the points, and every other point is more than 10 spacings away.
    """
    if coordinate < 0 and points.dtype.kind == "u":
        return None
    least = max(_LEAST, _SHARE * len(points))
    for axis in (2, 0, 1):  # most clouds have no such rows: the first look is enough
        if np.count_nonzero(points[:, axis] == coordinate) < least:
            return None
    rows = (points == coordinate).all(axis=1)
    count = int(np.count_nonzero(rows))
    if count < least or count == len(points):
        return None
    others = points[~rows].astype(np.float64)
    others = others[np.isfinite(others).all(axis=1)]
    if not len(others):
        return None
    low, high = np.quantile(strided(others), [0.02, 0.98], axis=0)
    spacing = float((high - low).max()) / math.sqrt(len(others))  # of a surface, roughly
    others -= coordinate
    nearest = math.sqrt(float(np.einsum("ij,ij->i", others, others).min()))
    return rows if nearest > _FAR * spacing else None


def unmeasured_value(values: NDArray) -> float | None:
    """The number that means "not measured" among depths or heights of any shape; None where none does.

    It is one that programs use for that, at least 8 values have it, it is the largest or the smallest, and
    it is farther from the others than these are from each other.
    """
    if not values.size:
        return None
    for value in (float(values.max()), float(values.min())):
        if math.isnan(value):
            finite = values[np.isfinite(values)]
            return unmeasured_value(finite) if finite.size else None
        if math.isinf(value) or not (value in SENTINELS or abs(value) >= _HUGE):
            continue
        rows = values == values.dtype.type(value)
        others = values[~rows]
        others = others[np.isfinite(others) & (others != 0)] if others.dtype.kind == "f" else others
        if np.count_nonzero(rows) < _LEAST or not others.size:
            continue
        low, high = float(others.min()), float(others.max())
        gap = value - high if value > high else low - value
        if gap > high - low:
            return value
    return None


def rows_with(points: NDArray, value: float | tuple[float, float, float]) -> Unmeasured:
    """The rows of points (N, 3) that the user declares not measured: one point, or one value of z."""
    wanted = np.array(value, points.dtype)
    rows = (points == wanted).all(axis=1) if wanted.ndim else points[:, 2] == wanted
    return Unmeasured(" ".join(f"{number:g}" for number in np.atleast_1d(wanted)), rows)


def find(points: NDArray, corrections: Corrections = NOTHING_CORRECTED) -> Unmeasured | None:
    """The rows of points (N, 3) that were not measured, as the user says or else the points tell."""
    stated = corrections.get(KEY)
    if stated is None:
        return unmeasured_points(points)
    return None if stated == NONE else rows_with(points, stated)


def find_in_frame(points: NDArray, decided: Decided) -> Unmeasured | None:
    """The rows of a frame's points (N, 3) that were not measured.

    Where points at (0, 0, 0) or (-1, -1, -1) were not measured in an earlier frame, they were not in this
    one, however few they are.
    """
    found = find(points, decided.corrections)
    place = decided.reading[KEY].value
    if found is None and KEY not in decided.corrections and place in _PLACES:
        rows = (points == _PLACES[place]).all(axis=1)
        return Unmeasured(place, rows) if rows.any() else None
    return found


def note(found: Unmeasured | None, dropped_by: Mapping[str, int], decided: Decided) -> None:
    """Put into the record which value means "not measured", and which points a cloud left out.

    dropped_by: reason -> how many, as `PointCloud` has it.
    """
    if found is not None or dropped_by or KEY in decided.corrections:
        decided.note(decide(found, decided.corrections, dropped_by.get(NOT_FINITE, 0)))


def decide(
    found: Unmeasured | None, corrections: Corrections = NOTHING_CORRECTED, not_finite: int = 0
) -> Decision:
    """Decide which value means "not measured", and count the points of a frame that it removes; else null.

    not_finite: how many points have a coordinate that is NaN, infinite or too large.
    """
    removed = 0 if found is None else int(np.count_nonzero(found.rows))
    parts = [f"{removed:,} points with the value that means 'not measured'"] if removed else []
    if not_finite:
        parts.append(f"{not_finite:,} points with coordinates that are not finite")
    why = f"Scan4D leaves out {' and '.join(parts)}" if parts else ""
    if KEY in corrections:
        return Decision(KEY, NONE if found is None else found.value, "user", "--read", why)
    if found is None:
        return Decision(KEY, NOT_FINITE if not_finite else None, "file", why=why)
    return Decision(KEY, found.value, "assumed", why=why, alternatives=(NONE,))
