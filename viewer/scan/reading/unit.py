"""The unit of length: as the user, the file or its remarks state, else unknown.

Where nothing states it, `guess_unit` finds the likely one from the size of the scan, for the user to confirm.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from ...bounds import Bounds
from ..contents import PointContents
from ..points import UNKNOWN_UNIT
from ..units import conversion, is_length, usable_unit
from ..upright import first_elevation
from .corrections import NOTHING_CORRECTED, Corrections
from .record import Decision
from .sequence import Decided

KEY = "unit"
_USUAL = ("mm", "m", "cm")

# "units: mm", "UNIT=meters", "length unit is mm"
_STATED = re.compile(r"\b(?:length[ _-]?)?units?\b\s*(?:[=:]|is|are)?\s*[\"']?([^\W\d_]+)", re.IGNORECASE)
_WORDS = {
    "millimeter": "mm", "millimetre": "mm", "centimeter": "cm", "centimetre": "cm", "meter": "m",
    "metre": "m",
    "inch": "in", "inche": "in", "foot": "ft", "feet": "ft", "micrometer": "µm", "micrometre": "µm",
    "micron": "µm", "kilometer": "km", "kilometre": "km",
}  # fmt: skip

# What is scanned: how long it is in metres, at least and below what; and in which units that is usual.
_SUBJECTS = (
    ("m", 0.03, 0.12, "an object that fits into a hand"),
    ("m", 0.12, 0.45, "a head or a hand"),
    ("m", 0.45, 3.0, "a body"),
    ("m", 3.0, 12.0, "a room"),
    ("mm", 0.12, 0.45, "a head or a hand"),
    ("mm", 0.45, 3.0, "a body"),
)


def stated_unit(remarks: Iterable[str]) -> tuple[str, str] | None:
    """The known unit of length that remarks of a file state, and the remark; None where none does."""
    for remark in remarks:
        for match in _STATED.finditer(remark):
            word = match[1].lower()
            unit = _WORDS.get(word.removesuffix("s"), word)
            if is_length(unit):
                return unit, remark.strip()
    return None


def decide(
    stated: str | None, remarks: Iterable[str] = (), corrections: Corrections = NOTHING_CORRECTED
) -> Decision:
    """The unit of a scan. stated: by the file or its columns, any text, or None."""
    if (stated_by_user := corrections.decision(KEY)) is not None:
        return stated_by_user
    if usable_unit(stated) is not None:
        return Decision(KEY, stated, "file")
    if (found := stated_unit(remarks)) is not None:
        unit, remark = found
        return Decision(KEY, unit, "file", f"comment {remark}")
    why = "The file does not state its unit of length"
    return Decision(KEY, UNKNOWN_UNIT, "assumed", why=why, alternatives=_USUAL, changes_numbers=True)


def note_in_frame(contents: PointContents, decided: Decided) -> None:
    """Put the unit that a frame states into the record, where neither the user nor an earlier one states it.

    A frame in another unit than that of an earlier one contradicts the record.
    """
    found, known = decide(contents.stated.unit, contents.remarks, decided.corrections), decided.reading[KEY]
    if found.source != "file":
        return
    if known.value is None or known.source == "assumed":
        decided.replace(found)
    elif known.source == "file" and known.value != found.value:
        decided.contradict(
            KEY, f"the unit of the file is {found.value}, but the unit of the scan is {known.value}"
        )


def guess_unit(bounds: Bounds, up: str) -> tuple[str, str] | None:
    """The likely unit of a scan of this size, and what it is a scan of then; None if no unit is likely.

    up: as `first_elevation` takes it, which recognises ground: that is surveyed in metres.
    """
    if first_elevation(bounds, up):
        return "m", "ground"
    size = float((bounds.high - bounds.low).max())
    for unit, least, most, what in _SUBJECTS:
        metres = conversion(unit, "m")
        if metres is not None and least <= size * metres < most:
            return unit, what
    return None
