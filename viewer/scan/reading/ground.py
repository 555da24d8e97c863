"""Decides whether the ground of a terrain is longitude and latitude in degrees, or lengths."""

from __future__ import annotations

from .corrections import NOTHING_CORRECTED, Corrections
from .record import Decision

KEY = "ground"
DEGREES, LENGTHS = "degrees", "lengths"


def decide_ground(
    stated: str | None,
    corner: tuple[float, float],
    size: tuple[float, float],
    span: float,
    corrections: Corrections = NOTHING_CORRECTED,
) -> Decision:
    """The decision whether the numbers of a ground are `DEGREES` or `LENGTHS`.

    stated: what the file says, None where it says nothing. corner: x and y of a corner. size: from there to
    the opposite corner. span: of the heights, in their unit.
    """
    if (by_user := corrections.decision(KEY)) is not None:
        return by_user
    if stated is not None:
        return Decision(KEY, stated, "file")
    if are_degrees(corner, size, span):
        found, other = DEGREES, LENGTHS
        why = (
            "The edges can be degrees of longitude and latitude. As lengths, they would make the terrain "
            "far too steep"
        )
    else:
        found, other = LENGTHS, DEGREES
        why = "The file does not state the unit of its ground coordinates"
    return Decision(KEY, found, "assumed", why=why, alternatives=(other,), changes_numbers=True)


def are_degrees(corner: tuple[float, float], size: tuple[float, float], span: float) -> bool:
    """Whether a ground is likely in degrees: its numbers can be, and the heights span more than they do."""
    x, y = ((start, start + extent) for start, extent in zip(corner, size, strict=True))
    inside = max(map(abs, x)) <= 360 and max(map(abs, y)) <= 90
    return inside and span > max(map(abs, size))
