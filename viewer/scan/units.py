"""Units of length: the names that scans and users give them, and which of these are known lengths."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ..errors import InputError, shortened

# A short word: letters first, then also digits and the signs of powers and fractions, such as in µm or US-ft.
_WORD = re.compile(r"[^\W\d_][\w./·^°-]{0,15}")
# Units to choose from, as people call them.
UNIT_WORDS = {"µm": "µm", "mm": "mm", "cm": "cm", "m": "m", "km": "km", "in": "inch", "ft": "foot"}

_METRES = {
    "nm": 1e-9, "µm": 1e-6, "um": 1e-6, "mm": 1e-3, "cm": 1e-2, "dm": 1e-1, "m": 1.0, "km": 1e3,
    "in": 0.0254, "ft": 0.3048,
}  # fmt: skip

_SPELT = {
    "micrometer": "µm", "mikrometer": "µm", "micron": "µm", "microns": "µm", "millimeter": "mm",
    "centimeter": "cm", "zentimeter": "cm", "decimeter": "dm", "dezimeter": "dm", "meter": "m",
    "kilometer": "km", "inch": "in", "inches": "in", "zoll": "in", "foot": "ft", "feet": "ft",
}  # fmt: skip
_SPELT |= {f"{name[:-2]}re": unit for name, unit in _SPELT.items() if name.endswith("meter")}
_SPELT |= {f"{name}s": unit for name, unit in _SPELT.items() if "met" in name}


def checked_unit(name: str, where: object = None) -> str:
    """The name of a unit as a user gives it. Raises InputError where it is no short word."""
    if usable_unit(name) is None:
        raise InputError(
            f"'{shortened(name)}' is not a usable name of a unit", where, "Use a short name such as mm"
        )
    return name


def usable_unit(name: str | None) -> str | None:
    """The name of a unit as a file tells it; None where it is no short word."""
    return name if name is not None and _WORD.fullmatch(name) else None


def plain_unit(word: str) -> str:
    """The usual name of a unit of length that a file spells out, such as "mm" for "Millimeter"; else the
    word."""
    return _SPELT.get(word.casefold().replace("\u03bc", "µ"), word.replace("\u03bc", "µ"))


def is_length(name: str) -> bool:
    """Whether it is a known length."""
    return name in _METRES


def conversion(given: str, wanted: str) -> float | None:
    """The factor from lengths in one unit to another; None where one of the two is no known length."""
    if given == wanted:
        return 1.0
    from_metres, to_metres = (_METRES.get(name.strip().replace("\u03bc", "µ")) for name in (given, wanted))
    return None if from_metres is None or to_metres is None else from_metres / to_metres


@dataclass(frozen=True)
class Scale:
    """The unit in which Scan4D shows lengths. factor: how many of these one unit of the scan is."""

    unit: str
    factor: float = 1.0

    @classmethod
    def of(cls, unit: str, shown: str | None) -> Scale:
        """The scale of a scan in this unit whose lengths are to be shown in another; None: in its own, as
        where one of the two is no known length."""
        factor = None if shown is None else conversion(unit, shown)
        return cls(unit) if shown is None or factor is None else cls(shown, factor)
