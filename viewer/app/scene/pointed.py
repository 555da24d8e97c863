"""What the mouse points at, and how that is told."""

from __future__ import annotations

import logging
import math

from ...analysis.pick import Picked
from ...scan.times import frame_in_words
from ...scan.units import Scale
from ..playing.playback import Playback
from .viewport import Viewport

log = logging.getLogger(__name__)

_DIGITS = 4  # of positions, after the leading digit of the scan's radius


class Pointer:
    """The place of the picture that is under the mouse.

    picked: what is seen there, None where nothing is. words: the same for users.
    """

    def __init__(self, viewport: Viewport, playback: Playback) -> None:
        self._viewport, self._playback = viewport, playback
        self.picked: Picked | None = None
        self.words: list[str] = []
        self._scale: Scale | None = None  # that they are told in

    def point_at(self, pixel: tuple[int, int] | None) -> None:
        """Take in which pixel of the view is under the mouse, None where the mouse is elsewhere."""
        picked = self._viewport.pick(pixel) if pixel else None
        scale = self._playback.scale
        if picked is self.picked and scale == self._scale:
            return
        self.picked, self.words, self._scale = picked, [], scale
        if picked is not None and (request := self._viewport.request) is not None:
            pose = request.pose
            frame = f"{frame_in_words(pose.index)}/{len(self._playback.timeline)}"
            self.words = describe_pick(picked, frame, scale, self._viewport.bounds(pose).radius)
        log.debug("under the mouse: %s", "; ".join(self.words))

    def in_full(self) -> Picked | None:
        """The place under the mouse in the picture in full."""
        return self._viewport.pick_in_full() or self.picked


def describe_pick(picked: Picked, frame: str, scale: Scale, radius: float) -> list[str]:
    """Position, frame, point and the point's attributes: the most wanted first.

    radius: of the scan, scan units; positions get the digits that matter for its size.
    """
    decimals = min(max(_DIGITS - math.floor(math.log10(scale.factor * radius or 1.0)), 0), 9)
    sure = "" if picked.uncertainty is None else f" ± {scale.factor * picked.uncertainty:.2g}"
    place = ", ".join(f"{scale.factor * v:.{decimals}f}" for v in picked.position)
    words = [f"{place}{sure} {scale.unit}", frame]
    seen = "measured" if picked.measured else f"filled from level {picked.level}"
    words.append(seen if picked.id is None else f"point {picked.id}, {seen}")
    if picked.at_outline:
        words.append("at an outline")
    words += [f"{name} {_number(value)}" for name, value in picked.scalars.items()]
    if picked.color is not None:
        words.append("colour #" + "".join(f"{channel:02x}" for channel in picked.color[:3]))
    if picked.normal is not None:
        words.append(f"normal {', '.join(f'{v:.2f}' for v in picked.normal)}")
    return words


def _number(value: float) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
