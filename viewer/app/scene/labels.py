"""Where labels stand over the view: beside their lines, off each other and off the ends of lines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from imgui_bundle import ImVec2

Line = tuple[ImVec2, ImVec2]

_ALONG = (0.5, 0.25, 0.75, 0.0, 1.0)  # places on the line, the best first
_AWAY = (1, 2, 3)  # distances from it, the same


@dataclass(frozen=True)
class Box:
    """A rectangle on the screen. low: its upper left corner. high: its lower right one."""

    low: ImVec2
    high: ImVec2

    @classmethod
    def around(cls, center: ImVec2, size: ImVec2) -> Box:
        """The box of this size with its middle there."""
        return cls(center - size * 0.5, center + size * 0.5)

    def overlaps(self, other: Box) -> bool:
        """Whether they share more than an edge."""
        return (
            self.low.x < other.high.x and other.low.x < self.high.x
            and self.low.y < other.high.y and other.low.y < self.high.y
        )  # fmt: skip

    def moved_into(self, area: Box) -> Box:
        """A box of the same size, all in the area; from its upper left corner on where it is larger."""
        size = self.high - self.low
        left = max(area.low.x, min(self.low.x, area.high.x - size.x))
        top = max(area.low.y, min(self.low.y, area.high.y - size.y))
        return Box(ImVec2(left, top), ImVec2(left, top) + size)

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


def free_place(
    size: ImVec2, line: Line, gap: float, area: Box, taken: Sequence[Box], lines: Sequence[Line]
) -> Box | None:
    """The place of a label beside its line, in the area and off all that is taken; None where there is none.

    size: of the label. gap: from the line, at least. lines: other ones, of which it covers as few as can be.
    """
    moved = [box.moved_into(area) for box in _beside(size, line, gap)]
    free = [
        box for box in moved
        if box.clipped(*line) is None and not any(box.overlaps(other) for other in taken)
    ]  # fmt: skip
    return min(free, key=lambda box: sum(box.clipped(*other) is not None for other in lines), default=None)


def usual_place(size: ImVec2, line: Line, gap: float, area: Box) -> Box:
    """The place of a label if nothing else were there."""
    return next(_beside(size, line, gap)).moved_into(area)


def _beside(size: ImVec2, line: Line, gap: float) -> Iterator[Box]:
    """Places above and below a line or at its sides, the best first."""
    start, stop = line
    along = stop - start
    length = math.hypot(along.x, along.y)
    across = ImVec2(along.y, -along.x) / length if length else ImVec2(0, -1)
    if across.y > 0:
        across = across * -1  # upward
    half = (abs(across.x) * size.x + abs(across.y) * size.y) / 2
    for times in _AWAY:
        for share in _ALONG:
            for side in (1, -1):
                away = side * (half * (2 * times - 1) + gap * times)
                yield Box.around(start + along * share + across * away, size)
