"""What the mouse points at, in words. Plain text, no window."""

from __future__ import annotations

import math

from ..pick import Picked

_DIGITS = 4  # of positions, after the leading digit of the scan's radius


def describe(picked: Picked, frame: str, unit: str, radius: float) -> list[str]:
    """Position, frame, point and the point's attributes: the most wanted first.

    radius: of the scan, scan units; positions get the digits that matter for its size.
    """
    decimals = min(max(_DIGITS - math.floor(math.log10(radius or 1.0)), 0), 9)
    words = [f"{', '.join(f'{v:.{decimals}f}' for v in picked.position)} {unit}", frame]
    seen = "measured" if picked.measured else f"filled from level {picked.level}"
    words.append(seen if picked.id is None else f"point {picked.id}, {seen}")
    words += [f"{name} {_number(value)}" for name, value in picked.scalars.items()]
    if picked.color is not None:
        words.append("colour #" + "".join(f"{channel:02x}" for channel in picked.color[:3]))
    if picked.normal is not None:
        words.append(f"normal {', '.join(f'{v:.2f}' for v in picked.normal)}")
    return words


def _number(value: float) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
