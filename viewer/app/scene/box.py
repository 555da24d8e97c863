"""Rectangles on the screen."""

from __future__ import annotations

from dataclasses import dataclass

from imgui_bundle import ImVec2

Line = tuple[ImVec2, ImVec2]


@dataclass(frozen=True)
class Box:
    """A rectangle on the screen. low: its upper left corner. high: its lower right one."""

    low: ImVec2
    high: ImVec2

    def clipped(self, start: ImVec2, stop: ImVec2) -> Line | None:
        """The part of a line that is in the box, None where none is."""
        begin, end, along = 0.0, 1.0, stop - start
        for place, step, low, high in (
            (start.x, along.x, self.low.x, self.high.x),
            (start.y, along.y, self.low.y, self.high.y),
        ):
            if step:
                enter, leave = sorted(((low - place) / step, (high - place) / step))
                begin, end = max(begin, enter), min(end, leave)
            elif not low <= place <= high:
                return None
        return (start + along * begin, start + along * end) if begin <= end else None
