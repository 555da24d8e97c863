"""What became of the points of the picture: counted when all is at rest, on a thread of its own."""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass

import numpy as np

from ...task import Task, in_background
from ..part import WindowPart
from .activity import Activity
from .viewport import Viewport

_REST = 0.3  # seconds after the last picture


@dataclass(eq=False)
class Counting(WindowPart):
    """counts: `Surface.point_counts` of the picture that is shown; None until they are there. is_blank:
    whether the picture shows nothing, neither points nor filled pixels."""

    name = "counting"
    doing = "Counting"
    viewport: Viewport
    activity: Activity

    def __post_init__(self) -> None:
        self.counts: dict[str, int] | None = None
        self.is_blank = False
        self._picture = 0  # number of the one that is counted
        self._task: Task | None = None
        self._future: Future[dict[str, int]] | None = None

    def advance(self, now: float) -> bool:
        """Begin to count while nothing moves, or take in what was counted; whether there are other counts
        than before."""
        had, viewport = self.counts, self.viewport
        if viewport.number != self._picture:
            self.cancel()
            self.counts, self.is_blank = None, False
            if not self.activity.is_moving and viewport.is_complete and now > viewport.shown_at + _REST:
                self._begin()
        if self._future is not None and self._future.done():
            self.counts, self._future = self._future.result(), None
            surface = viewport.surface
            assert surface is not None
            self.is_blank = not self.counts["drawn"] and not np.isfinite(surface.depth).any()
        return self.counts is not had

    def _begin(self) -> None:
        viewport, surface = self.viewport, self.viewport.surface
        assert surface is not None
        self._picture, self._task = viewport.number, Task("Counting points")
        self._future = in_background(self._task, surface.counting())

    def cancel(self) -> None:
        """Stop counting."""
        if self._task is not None:
            self._task.cancel()
        self._task = self._future = None

    def close(self) -> None:
        """Stop counting."""
        self.cancel()


def words(viewport: Viewport, counts: Mapping[str, int] | None) -> list[tuple[str, str]]:
    """(name, number), as many each time: what is drawn of the points, and why the others are not.

    counts: those of the picture; None while they are not there yet.
    """
    surface = viewport.surface
    if surface is not None and surface.stats.left_out:
        left_out = surface.stats.left_out
        drawn = surface.scanned.pose.count - left_out
        pixels = math.prod(surface.size) / math.prod(viewport.size)
        return [
            ("Drawn", f"{drawn:,} at most"),
            ("Preview", f"{left_out:,} points left out"),
            ("", f"{pixels:.0%} of the pixels"),
        ]
    names = ("drawn", "hidden", "outside", *(("away",) if surface and surface.stats.faces_away else ()))
    return [(name.capitalize(), "..." if counts is None else f"{counts[name]:,}") for name in names]
