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
class Place:
    """A window without its frame, in screen coordinates; where it goes back to while it is maximised."""

    left: Pixels
    top: Pixels
    width: Pixels
    height: Pixels
    maximised: bool = False


def reachable(place: Place, screens: Sequence[Area]) -> Place | None:
    """The place, no larger than its screen; None where no screen shows enough of its upper edge."""
    for left, top, width, height in screens:
        visible = min(place.left + place.width, left + width) - max(place.left, left)
        if visible >= _GRIP and top <= place.top <= top + height - _GRIP:
            fitted = (max(_LEAST, min(place.width, width)), max(_LEAST, min(place.height, height)))
            return Place(place.left, place.top, *fitted, place.maximised)
    return None
