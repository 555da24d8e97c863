"""The anatomical space of coordinates: what a file's remarks say of it.

LPS: x to the left, y to the back, z up, as DICOM and ITK have it. RAS: x to the right, y to the front.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from .corrections import NOTHING_CORRECTED, Corrections
from .record import Decision

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
    why = f"The file does not state its axes. Scan4D assumes {LPS} where landmark files need them"
    return Decision(KEY, UNKNOWN, "assumed", why=why, alternatives=(LPS, RAS))


def landmark_space(decision: Decision) -> str:
    """The space in which landmark files are read and written for a scan: its own, else LPS."""
    return RAS if decision.value == RAS else LPS
