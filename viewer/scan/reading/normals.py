"""Whether the normals of a file can be used: programs that have none write zeros or NaN in their place.

Where only some are so, Scan4D estimates these from the points around and their normals.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...task import checkpoint
from ..points import PointCloud
from .corrections import NOTHING_CORRECTED, Corrections
from .record import Decision
from .sequence import Decided

KEY = "normals"
STORED, PARTLY, DROPPED, NONE = "stored", "partly", "dropped", "none"
_AT_ONCE = 1 << 18  # rows
_NEIGHBOURS = 8  # with a normal, by which a missing one is estimated
_IN_A_LINE = 1e-4  # variance across a line as a part of that along it
_LEAST_LENGTH = 1e-30
_REPORTS = {
    DROPPED: "all stored normals are zero or not finite, so Scan4D estimates them",
    PARTLY: "some stored normals are zero or not finite, so Scan4D estimates them from neighbouring points",
}


class NormalsFound(NamedTuple):
    """Normals that can be used, and how many of the file's cannot.

    normals: (N, 3) as stored, of any length, bad rows 0; None where no row is good. bad: how many rows are
    zero or not finite. points: N.
    """

    normals: NDArray | None
    bad: int
    points: int


def usable_normals(normals: NDArray) -> NormalsFound:
    """Check normals (N, 3) of any real type: bad rows become 0, and where all are bad there are none."""
    bad = bad_rows(normals)
    if not len(bad):
        return NormalsFound(normals, 0, len(normals))
    if len(bad) == len(normals):
        return NormalsFound(None, len(bad), len(normals))
    cleaned = normals.copy()
    cleaned[bad] = 0
    return NormalsFound(cleaned, len(bad), len(normals))


def bad_rows(normals: NDArray) -> NDArray[np.intp]:
    """The rows of normals (N, 3) that are zero or not finite, (B,)."""
    found = [np.empty(0, np.intp)]
    for start in range(0, len(normals), _AT_ONCE):
        part = normals[start : start + _AT_ONCE]
        if part.dtype.kind != "f" or part.dtype.itemsize < 4:
            part = part.astype(np.float32)
        with np.errstate(all="ignore"):
            squares = np.einsum("ij,ij->i", part, part)
            if (squares > 0).all() and (squares < np.inf).all():
                continue
            largest = np.abs(part).max(axis=1)  # squares of tiny normals are 0, those of huge ones infinite
        found.append(start + np.flatnonzero(~((largest > 0) & (largest < np.inf))))
    return np.concatenate(found)


def decide(found: NormalsFound | None, corrections: Corrections = NOTHING_CORRECTED) -> Decision:
    """Decide what becomes of the normals of a file. found: None where it has none: the value is null."""
    decision = _of_file(found)
    if KEY in corrections and corrections[KEY] == STORED and decision.value == PARTLY:
        decision = replace(
            decision, value=STORED, why="Points whose normal is zero or not finite stay without a normal"
        )
    if corrections.get(KEY) == NONE:
        return Decision(KEY, NONE, "user", "--read", "Scan4D estimates normals instead")
    return replace(decision, source="user", where="--read") if KEY in corrections else decision


def _of_file(found: NormalsFound | None) -> Decision:
    if found is None or not found.points:
        return Decision(KEY, None, "file")
    if found.normals is None:
        why = f"All {found.points:,} normals are zero or not finite, so Scan4D estimates normals"
        return Decision(KEY, DROPPED, "file", why=why)
    if found.bad:
        why = (
            f"{found.bad:,} of {found.points:,} normals are zero or not finite, so Scan4D estimates them "
            "from neighbouring points"
        )
        return Decision(KEY, PARTLY, "assumed", why=why, alternatives=(STORED, NONE))
    return Decision(KEY, STORED, "file")


def with_usable_normals(cloud: PointCloud, decided: Decided) -> PointCloud:
    """The cloud without normals that are zero or not finite, which the record and a message name."""
    found = None if cloud.normals is None else usable_normals(cloud.normals)
    decision = decide(found, decided.corrections)
    if decision.value is not None:
        decided.note(decision)
    if decision.value in _REPORTS:
        decided.report("normals", _REPORTS[decision.value])
    if decision.value == NONE:
        return replace(cloud, normals=None)
    if found is None or found.normals is cloud.normals:
        return cloud
    if decision.value == PARTLY and found.normals is not None:
        fill_from_neighbours(found.normals, cloud.positions)
    return replace(cloud, normals=found.normals)


def fill_from_neighbours(normals: NDArray, positions: NDArray[np.float32]) -> None:
    """Fill normals (N, 3) that are zero, in place: those of planes through the nearest points with a normal,
    on the side of the normals of these. positions: (N, 3)."""
    from scipy.spatial import cKDTree

    has_none = ~normals.any(axis=1)
    rows, others = np.flatnonzero(has_none), np.flatnonzero(~has_none)
    tree = cKDTree(positions[others], balanced_tree=False, compact_nodes=False)
    for start in range(0, len(rows), _AT_ONCE):
        checkpoint(start / len(rows))
        part = rows[start : start + _AT_ONCE]
        _, near = tree.query(positions[part], min(_NEIGHBOURS, len(others)))
        near = others[near.reshape(len(part), -1)]
        around = normals[near].astype(np.float64)
        around /= np.linalg.norm(around, axis=2, keepdims=True)
        mean = around.sum(axis=1)
        points = np.concatenate([positions[part, None], positions[near]], axis=1).astype(np.float64)
        spread, across = np.linalg.eigh(_covariances(points))
        found = across[:, :, 0]
        found *= np.where(np.einsum("ij,ij->i", found, mean) < 0, -1, 1)[:, None]
        is_line = spread[:, 1] <= _IN_A_LINE * spread[:, 2]
        found[is_line] = mean[is_line]
        normals[part] = found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), _LEAST_LENGTH)


def _covariances(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The covariance of each set of points, (M, K, 3), as (M, 3, 3)."""
    around = points - points.mean(axis=1, keepdims=True)
    return np.einsum("mki,mkj->mij", around, around)
