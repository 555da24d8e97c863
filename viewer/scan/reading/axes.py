"""The anatomical space of coordinates: what a file's remarks say of it.

LPS: x to the left, y to the back, z up, as DICOM and ITK have it. RAS: x to the right, y to the front.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..points import PointCloud
from .corrections import NOTHING_CORRECTED, Corrections
from .record import Decision
from .sequence import Decided

KEY = "axes"
LPS, RAS, UNKNOWN = "LPS", "RAS", "unknown"

# "SPACE=RAS" as 3D Slicer and VTK write it, "space: left-posterior-superior" as NRRD does, "axes: LPS".
_STATED = re.compile(
    r"\b(?:space|coordinate[ _-]?system|axes|orientation)\b\s*[=:]?\s*[\"']?([a-z]+(?:[ _-][a-z]+){0,2})",
    re.IGNORECASE,
)
_WORDS = {"left": "l", "right": "r", "posterior": "p", "anterior": "a", "superior": "s", "inferior": "i"}
_SPACES = {"lps": LPS, "ras": RAS}


def stated_space(remarks: Iterable[str]) -> tuple[str, str] | None:
    """The space that remarks of a file state, and the remark; None where none does."""
    for remark in remarks:
        for match in _STATED.finditer(remark):
            words = re.split(r"[ _-]", match[1].lower())
            letters = "".join(_WORDS.get(word, "") for word in words)
            if space := _SPACES.get(words[0]) or _SPACES.get(letters):
                return space, remark.strip()
    return None


def decide(remarks: Iterable[str], corrections: Corrections = NOTHING_CORRECTED) -> Decision:
    """The space of the coordinates: as the user or a remark states, else unknown."""
    if (stated_by_user := corrections.decision(KEY)) is not None:
        return stated_by_user
    if (stated := stated_space(remarks)) is not None:
        space, remark = stated
        return Decision(KEY, space, "file", f"comment {remark}")
    why = f"The file does not state its axes. When a landmark file needs axes, Scan4D assumes {LPS}"
    return Decision(KEY, UNKNOWN, "assumed", why=why, alternatives=(LPS, RAS))


def note_turned(cloud: PointCloud, decided: Decided) -> PointCloud:
    """The cloud on the axes that the user states, such as "+x -z +y"; else as it is.

    The record has the axes then, unless it has them already.
    """
    decided.note(decide((), decided.corrections))
    rows = str(decided.corrections.get(KEY, "")).split()
    if len(rows) != 3:
        return cloud
    turn = np.zeros((3, 3))
    for row, word in enumerate(rows):
        turn[row, "xyz".index(word[1])] = 1 if word[0] == "+" else -1
    return turned(cloud, turn)


def turned(cloud: PointCloud, turn: NDArray[np.float64]) -> PointCloud:
    """The cloud with its coordinates exchanged and negated: turn (3, 3) is a signed permutation."""

    def of(vectors: NDArray) -> NDArray:
        return np.ascontiguousarray(vectors @ turn.T.astype(vectors.dtype))

    others = {name: getattr(cloud, name) for name in ("normals", "remainders", "viewpoint", "axes")}
    arrays = {name: values for name, values in others.items() if values is not None}
    if (half_axes := arrays.pop("axes", None)) is not None:
        half_axes = np.column_stack([of(half_axes[:, :3]), half_axes[:, 3]])
    given: dict[str, Any] = {name: of(values) for name, values in arrays.items()}
    return replace(cloud, positions=of(cloud.positions), origin=of(cloud.origin), axes=half_axes, **given)


def landmark_space(decision: Decision) -> str:
    """The space in which landmark files are read and written for a scan: its own, else LPS."""
    return RAS if decision.value == RAS else LPS
