"""The turntable: the view goes round the subject by itself, by the clock. Plain arithmetic, no window."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Annotated

from ...camera import Camera
from ...document.schema import Kind
from ...geometry import Vector

SECONDS = (6.0, 12.0, 24.0, 60.0)  # for a turn, to choose from
USUAL = 12.0
_STEP = 1 / 60  # seconds between pictures at least


TurnTime = Annotated[float, Kind("a time for a turn", SECONDS.__contains__)]


class Turntable:
    """Turns a camera about its up axis. seconds: that a whole turn takes."""

    def __init__(self, seconds: float = USUAL) -> None:
        self.seconds = seconds
        self._last: float | None = None  # by the clock, when it was turned; None while it stands

    def items(self) -> Iterator[tuple[str, Callable[[], object], bool]]:
        """Times for a turn to choose from: title, what it does, whether it is the one."""
        for seconds in SECONDS:
            yield f"{seconds:g} s", partial(setattr, self, "seconds", seconds), seconds == self.seconds

    @property
    def is_on(self) -> bool:
        """Whether it turns."""
        return self._last is not None

    def start(self, now: float) -> None:
        """Turn from now on. now: seconds of the clock."""
        self._last = now

    def stop(self) -> None:
        """Stand still."""
        self._last = None

    def next_change(self, now: float) -> float:
        """Seconds until there is another picture to show; infinite while it stands."""
        return math.inf if self._last is None else self._last + _STEP - now

    def turned(self, camera: Camera, pivot: Vector | None, now: float) -> Camera:
        """The camera, turned as far as the table has since then. pivot: None is the camera's target."""
        if self._last is None or self.next_change(now) > 0:
            return camera
        degrees = 360 * (now - self._last) / self.seconds
        self._last = now
        return camera.orbited(degrees, 0.0, pivot)
