"""The likely unit of a scan whose files state none: guessed from its size, for the user to confirm."""

from __future__ import annotations

from ..bounds import Bounds
from .units import conversion
from .upright import first_elevation

# What is scanned: how long it is in metres, at least and below what; and in which units that is usual.
_SUBJECTS = (
    ("m", 0.03, 0.12, "an object that fits into a hand"),
    ("m", 0.12, 0.45, "a head or a hand"),
    ("m", 0.45, 3.0, "a body"),
    ("m", 3.0, 12.0, "a room"),
    ("mm", 0.12, 0.45, "a head or a hand"),
    ("mm", 0.45, 3.0, "a body"),
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
