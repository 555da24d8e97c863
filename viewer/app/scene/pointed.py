"""What the mouse points at, and the words on it."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass

from ...analysis.pick import Picked
from ...output.legend import goes_by_length, value_unit
from ...scan.times import frame_in_words
from ...scan.units import Scale
from ..commands import Command
from ..part import WindowPart, remembered
from ..playing.playback import Playback
from .viewport import Viewport

log = logging.getLogger(__name__)

_DIGITS = 4  # of positions, after the leading digit of the scan's radius


@dataclass(eq=False)
class Pointer(WindowPart):
    """The position in the picture that is under the mouse.

    picked: what is seen there, None where nothing is. words: the same for users.
    """

    name = "pointer"
    viewport: Viewport
    playback: Playback
    has_details: bool = remembered(False)  # whether the words have all that is known of the point

    def __post_init__(self) -> None:
        self.picked: Picked | None = None
        self.words: list[str] = []
        # The unit of the words, and whether they have details:
        self._displayed: tuple[Scale, bool] | None = None

    def toggle_details(self) -> None:
        """Switch whether the words have all that is known of the point."""
        self.has_details = not self.has_details

    def point_at(self, pixel: tuple[int, int] | None) -> None:
        """Take in which pixel of the view is under the mouse, None where the mouse is elsewhere."""
        picked = self.viewport.probe.pick(pixel) if pixel else None
        displayed = self.playback.scale, self.has_details
        if picked is self.picked and displayed == self._displayed:
            return
        self.picked, self.words, self._displayed = picked, [], displayed
        if picked is not None and (request := self.viewport.request) is not None:
            pose = request.pose
            frame = f"{frame_in_words(pose.index)}/{len(self.playback.timeline)}"
            radius, shown = self.viewport.bounds(pose).radius, request.look.color_by
            self.words = describe_pick(picked, frame, self.playback.scale, radius, shown)
            if self.has_details:
                self.words += point_details(picked, shown)
        log.debug("under the mouse: %s", "; ".join(self.words))

    def in_full(self) -> Picked | None:
        """The position under the mouse in the picture in full."""
        return self.viewport.probe.pick_in_full() or self.picked

    COMMANDS = (
        Command(
            "point_details", "Point details in status bar", toggle_details,
            is_on=lambda pointer: pointer.has_details,
        ),
    )  # fmt: skip


def describe_pick(picked: Picked, frame: str, scale: Scale, radius: float, shown: str = "") -> list[str]:
    """Position, frame and the number that colours show, the most wanted first.

    radius: of the scan, scan units; positions get the digits that matter for its size. shown: what the
    look colours by.
    """
    decimals = min(max(_DIGITS - math.floor(math.log10(scale.factor * radius or 1.0)), 0), 9)
    sure = "" if picked.uncertainty is None else f" ± {scale.factor * picked.uncertainty:.2g}"
    position = ", ".join(f"{scale.factor * v:.{decimals}f}" for v in picked.position)
    words = [f"{position}{sure} {scale.unit}", frame]
    if shown in picked.scalars:
        factor = scale.factor if goes_by_length(shown) else 1
        value, unit = _number(factor * picked.scalars[shown]), value_unit(shown, scale.unit)
        words.append(f"{shown} {value} {unit}".rstrip())
    if not picked.measured:
        words.append(f"in a hole that the renderer filled from level {picked.level}")
    if picked.at_outline:
        words.append(f"may be the surface in front or behind ({picked.doubt:.0%})")
    return words


def point_details(picked: Picked, shown: str = "") -> list[str]:
    """The index of the point, and its attributes but the one that `describe_pick` has shown."""
    words = [] if picked.id is None else [f"point {picked.id}"]
    words += [f"{name} {_number(value)}" for name, value in picked.scalars.items() if name != shown]
    if picked.color is not None:
        words.append("colour #" + "".join(f"{channel:02x}" for channel in picked.color[:3]))
    if picked.normal is not None:
        words.append(f"normal {', '.join(f'{v:.2f}' for v in picked.normal)}")
    return words


def _number(value: float) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
