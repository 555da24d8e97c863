"""Where the window is on its screens. Plain arithmetic, no window."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from ..document.schema import Kind

Area = tuple[int, int, int, int]  # left, top, width, height; screen coordinates

_LEAST = 160  # width and height that a window keeps
_GRIP = 80  # of its upper edge that must be on a screen, so that a mouse can drag it
_FARTHEST = 2**15  # from the origin of the screens
Pixels = Annotated[int, Kind("a place on screens", lambda value: abs(value) < _FARTHEST)]


@dataclass(frozen=True)
class WindowPlacement:
    """A window without its frame, in screen coordinates; where it goes back to while it is maximised."""

    left: Pixels
    top: Pixels
    width: Pixels
    height: Pixels
    maximised: bool = False


def reachable(placement: WindowPlacement, screens: Sequence[Area]) -> WindowPlacement | None:
    """The place, no larger than its screen; None where no screen shows enough of its upper edge."""
    for left, top, width, height in screens:
        visible = min(placement.left + placement.width, left + width) - max(placement.left, left)
        if visible >= _GRIP and top <= placement.top <= top + height - _GRIP:
            fitted = (max(_LEAST, min(placement.width, width)), max(_LEAST, min(placement.height, height)))
            return WindowPlacement(placement.left, placement.top, *fitted, placement.maximised)
    return None
