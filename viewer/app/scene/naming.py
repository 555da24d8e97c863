"""The renderer's name over the view, for a moment after the user has stepped to it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...backends import backends
from ..commands import Command
from ..part import WindowPart
from .rendering import Rendering
from .viewport import Viewport

_SECONDS = 1.5  # from the first picture by that renderer


@dataclass(eq=False)
class Naming(WindowPart):
    """Steps to another renderer and shows its name until the user has seen what it draws.

    shown: the name, None where there is none.
    """

    name = "naming"
    doing = "Naming the renderer"
    rendering: Rendering
    viewport: Viewport

    def __post_init__(self) -> None:
        self._ends = -math.inf  # by the clock; infinite while the first picture is awaited
        self.shown: str | None = None

    def step(self, by: int) -> None:
        """Draw with the next renderer, 1, or the one before, -1."""
        self.rendering.step(by)
        self._ends = math.inf

    def advance(self, now: float) -> bool:
        """Look at what is drawn; whether the name to show has changed. now: by the clock."""
        before, chosen, surface = self.shown, self.rendering.backend, self.viewport.surface
        drawn = surface.stats.backend if surface is not None and self.viewport.is_there else None
        if math.isinf(self._ends) and self._ends > now and drawn == chosen:
            self._ends = now + _SECONDS
        self.shown = backends()[chosen].title if chosen is not None and now < self._ends else None
        return self.shown != before

    def next_change(self, now: float) -> float:
        """Seconds until the name goes; infinite where none does by itself."""
        return self._ends - now if now < self._ends else math.inf

    COMMANDS = (
        Command("backend", "Next renderer", lambda naming: naming.step(1), "B"),
        Command("backend_before", "Previous renderer", lambda naming: naming.step(-1), "Shift+B"),
    )
