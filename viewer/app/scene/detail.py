"""How finely a scan is drawn while it moves, chosen by how long its pictures took. No clock inside."""

from __future__ import annotations

from collections import deque
from functools import cache
from itertools import takewhile
from statistics import median
from typing import NamedTuple

_SHARES = tuple(2 ** (-n / 6) for n in range(1, 100))
_SCALES = (0.5**0.5, 0.5)
_MANY = 30_000  # points; with fewer, resolution gains more time than it costs of the picture
_FEWEST = 10_000
_SLOW = 5  # pictures in a row that tell that less must be drawn
_FAST = 8  # the same, that more can be
_MARGIN = 0.9  # of the goal that a finer picture may be expected to take: less than times vary
_MUCH = 2.0  # times the goal: one such picture is enough


class Quality(NamedTuple):
    """share: of the points. scale: of width and height. 1 and 1: the picture in full."""

    share: float = 1.0
    scale: float = 1.0

    @property
    def cost(self) -> float:
        """The time that a picture takes, against that in full; no less, as some of it always stays."""
        return self.share * self.scale


@cache
def qualities(points: int) -> tuple[Quality, ...]:
    """Qualities for a scan of so many points, in full first: fewer points, fewer pixels, fewer points."""
    many = [1.0, *takewhile(lambda share: share * points >= _MANY, _SHARES)]
    few = [share for share in _SHARES if share < many[-1] and share * points >= _FEWEST]
    return (
        *(Quality(share) for share in many),
        *(Quality(many[-1], scale) for scale in _SCALES),
        *(Quality(share, _SCALES[-1]) for share in few),
    )


class Detail:
    """The quality to draw at, for pictures that take about as long as they may.

    Finer pictures are drawn only where even in proportion to their cost they would be in time
    with a margin, and then they are: the quality does not go up and down by itself.
    """

    def __init__(self) -> None:
        self.quality = Quality()
        self._times: deque[float] = deque(maxlen=_FAST)  # ms, of pictures at this quality

    def note(self, ms: float, quality: Quality, goal_ms: float, points: int) -> None:
        """Take in what a picture of so many points took at a quality, and should have taken at most."""
        if quality != self.quality:
            if quality != Quality() or ms > _MARGIN * goal_ms:
                return
            self._go_to(quality)  # a picture in full was in time
        self._times.append(ms)
        recent = list(self._times)[-_SLOW:]
        if ms > _MUCH * goal_ms or (len(recent) == _SLOW and median(recent) > goal_ms):
            coarser = [other for other in qualities(points) if other.cost < quality.cost]
            in_time = _in_time(coarser, min(recent) / quality.cost, goal_ms)
            self._go_to([*in_time[:1], *coarser[-1:], quality][0])
        elif len(self._times) == _FAST:
            finer = [other for other in qualities(points) if other.cost > quality.cost]
            in_time = _in_time(finer, median(self._times) / quality.cost, _MARGIN * goal_ms)
            self._go_to([*in_time, quality][0])

    def _go_to(self, quality: Quality) -> None:
        if quality != self.quality:
            self.quality = quality
            self._times.clear()


def _in_time(choices: list[Quality], full_ms: float, goal_ms: float) -> list[Quality]:
    return [quality for quality in choices if quality.cost * full_ms <= goal_ms]
