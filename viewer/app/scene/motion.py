"""Whether what is shown is being moved. No clock inside."""

from __future__ import annotations

import math

REST = 0.12  # seconds without a change after which it is at rest; a wheel's clicks come faster


class Motion:
    """Pictures that follow one another: playing, dragging, the wheel, scrubbing, resizing.

    ends: by the clock, when all is at rest if nothing else changes.
    """

    def __init__(self) -> None:
        self.ends = -math.inf
        self._shown = -math.inf

    def change(self, now: float, held: bool) -> None:
        """Another picture is asked for. A single one is no motion, unless more are to come (held)."""
        self.ends = now + REST if held or now < self._shown + REST else -math.inf

    def show(self, now: float) -> None:
        """The picture that was asked for is there, or the window shows it. What that took is not rest."""
        self._shown = now
        if self.ends > -math.inf:
            self.ends = now + REST

    def end(self) -> None:
        """All is at rest now; what comes next is the first of its kind."""
        self.ends = self._shown = -math.inf
