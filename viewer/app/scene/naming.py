"""The renderer's name over the view, for a moment after the user has stepped to it."""

from __future__ import annotations

import math

from ...backends import backends
from .rendering import Rendering
from .viewport import Viewport

_SECONDS = 1.5  # from the first picture by that renderer


class Naming:
    """Steps to another renderer and shows its name until the user has seen what it draws.

    name: to show, None where there is none.
    """

    def __init__(self, rendering: Rendering, viewport: Viewport) -> None:
        self._rendering, self._viewport = rendering, viewport
        self._ends = -math.inf  # by the clock; infinite while the first picture is awaited
        self.name: str | None = None

    def step(self, by: int) -> None:
        """Draw with the next renderer, 1, or the one before, -1."""
        self._rendering.step(by)
        self._ends = math.inf

    def advance(self, now: float) -> bool:
        """Look at what is drawn; whether the name to show has changed. now: by the clock."""
        before, chosen, surface = self.name, self._rendering.backend, self._viewport.surface
        drawn = surface.stats.backend if surface is not None and self._viewport.is_there else None
        if math.isinf(self._ends) and self._ends > now and drawn == chosen:
            self._ends = now + _SECONDS
        self.name = backends()[chosen].title if chosen is not None and now < self._ends else None
        return self.name != before

    def next_change(self, now: float) -> float:
        """Seconds until the name goes; infinite where none does by itself."""
        return self._ends - now if now < self._ends else math.inf
