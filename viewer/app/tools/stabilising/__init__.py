"""Stabilising: the motion of a part that stays rigid, such as the head, is removed from what is shown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from imgui_bundle import icons_fontawesome_6 as icons
from numpy.typing import NDArray

from ....analysis.measures import Series
from ....analysis.motion import distances
from ....analysis.motion.axes import anatomical_axes
from ....analysis.motion.curves import RESIDUAL, SHIFTS, TURNS, motion_curves
from ....document.landmarks import Landmarks
from ....errors import InputError
from ....geometry import Vector
from ....look import Look
from ....output.overlays import NOTHING_DRAWN, DrawnMarks, Stabilised
from ....rigid import STILL, Rigid
from ....scan.pose import Pose
from ...commands import Command
from ...tool_context import FrameSpan, ToolContext
from ...ui import Ui
from .._cached import Cached
from .._painting import Painted, Painting, PaintingTool, Sphere
from . import panel
from .choices import PAINTED, Settings, Stabilising
from .motion_colors import REGION, MotionColors
from .stabiliser import Asked, Stabiliser
from .words import Facts, facts_of, motion_gap_spans

TITLE = "Stabilise"
_COLORED = 4.0  # times the limit of what is close: the distance that has the last colour


class Tool(PaintingTool):
    """The tool that stabilises the scan. stabiliser: has motions found. colors: has numbers found to colour
    by. painting: the brush that paints the region.

    The class has more than 30 methods because each hook of a tool and each of its commands is one.
    """

    def __init__(self, context: ToolContext) -> None:
        self.context = context
        self.stabiliser = Stabiliser(context)
        self.colors = MotionColors(context)
        self.painting = Painting(
            context,
            Painted(
                "region", lambda: self.choices.reference, lambda: self.choices.spheres, self._paint,
                "Drag over the parts that stay rigid, such as the forehead and the nose.",
            ),
        )  # fmt: skip
        self._cached = Cached()
        self._laid: tuple[object, ...] = ()

    @property
    def choices(self) -> Stabilising:
        """The choices about the open scan."""
        return self.context.document.part(Stabilising)

    def choose(self, step: str, *, merge: bool = False, **changes: Any) -> None:
        """Change choices. step: what Undo calls it. merge: with the same change just before."""
        self.context.change(step, self.choices.changed(**changes), merge=step if merge else None)

    @property
    def frame(self) -> int:
        """The frame that is shown."""
        return self.context.index if self.context.pose is None else self.context.pose.index

    def toggle(self) -> None:
        """Show the scan stabilised, or as recorded. Raises InputError for a scan of one frame."""
        self._check_frames()
        is_shown = not self.choices.is_shown
        self.choose("Stabilise" if is_shown else "Show as recorded", is_shown=is_shown)
        if is_shown:
            self.stabiliser.resume()
            self.context.reveal()

    def _paint(self, step: str, spheres: tuple[Sphere, ...]) -> None:
        self.choose(step, region=PAINTED, spheres=spheres)

    def paint(self, *, erasing: bool = False) -> None:
        """Have drags paint the region, or erase from it, or do neither. Raises InputError for a scan of one
        frame, and where there is nothing to erase."""
        self._check_frames()
        self.painting.toggle(erasing=erasing)

    @property
    def is_colored(self) -> bool:
        """Whether the colours show distances from the reference."""
        return self.context.document.look.color_by == distances.NAME

    @property
    def shows_region(self) -> bool:
        """Whether the colours show the rigid region."""
        return self.context.document.look.color_by == REGION

    def toggle_region(self) -> None:
        """Colour the rigid region, for which the scan is stabilised; or as usual."""
        self._color_by(None if self.shows_region else REGION, "Show region", 1.0)

    def toggle_colors(self) -> None:
        """Colour the scan by distances from the reference frame, for which it is stabilised; or as usual.
        Raises InputError for a scan of one frame."""
        close = self.stabiliser.close
        high = None if close is None else _COLORED * close
        self._color_by(None if self.is_colored else distances.NAME, "Colour by distance", high)

    def _color_by(self, name: str | None, step: str, high: float | None) -> None:
        """Colour by a number of a motion, from 0 to an end; None: as usual."""
        look, usual = self.context.document.look, Look()
        if name is None:
            look = replace(look, color_by=usual.color_by, low=usual.low, high=usual.high)
            self.context.change("Change colours", look=look)
            return
        self._check_frames()
        look = replace(look, color_by=name, low=0.0, high=high)
        self.context.change(step, self.choices.changed(is_shown=True), look=look)
        self.stabiliser.resume()
        self._lay()  # the numbers, not known yet, are there before the next picture asks for them

    def _check_frames(self) -> None:
        if len(self.context.timeline) < 2:
            raise InputError("The scan has one frame, so there is no motion to remove.")

    @property
    def placed(self) -> list[str]:
        """The names of the landmarks that the user set in the reference frame, in their order."""
        frame = self.choices.reference
        named = self.context.document.part(Landmarks).listed
        return [one.name for one in named if one.key_at(frame) is not None]

    @property
    def _places(self) -> Mapping[str, Vector]:
        """The places of the region's landmarks in the reference frame, as far as the user set them there."""
        choices = self.choices
        if not choices.landmarks:  # this is asked in each turn of the window
            return {}
        named = {one.name: one for one in self.context.document.part(Landmarks).all}
        keys = {name: named[name].key_at(choices.reference) for name in choices.landmarks if name in named}
        return {name: key.position for name, key in keys.items() if key is not None}

    def advance(self, budget: float) -> bool:
        """Have motions found, and the scan shown by them; whether there is something new."""
        choices = self.choices
        asked = Asked.of(self.context.timeline, self.context.unit, choices, self._places)
        is_wanted = choices.is_shown and not (self.painting.is_on or choices.is_empty)
        is_new = self.stabiliser.advance(asked, is_wanted)
        self.colors.advance(self.stabiliser.motions, self.is_colored or self.shows_region)
        self.context.followed.curves[self.context.name] = self._curves()
        return self._lay() or is_new

    def _lay(self) -> bool:
        """Move the scan by what is known of the frame that is shown; whether that has changed something."""
        known, pose = self.stabiliser.known, self.context.playback.pose
        is_shown = self.choices.is_shown and bool(known)
        self.context.followed.still = self._still() if is_shown else None
        has_numbers = bool(known) or self.is_colored or self.shows_region
        values = self.colors.of(pose) if has_numbers and pose is not None else None
        now = (known.get(self.frame), self._is_whole) if is_shown else None
        wanted = (self.context.timeline, now, values is not None and id(values))
        if wanted == self._laid:
            return False
        self._laid = wanted
        numbers = self._numbers if has_numbers else None
        self.context.lay(numbers, self._motion if is_shown else None)
        return True

    def _numbers(self, pose: Pose) -> Mapping[str, NDArray[np.float32]]:
        return self.colors.of(pose)

    @property
    def _is_whole(self) -> bool:
        return len(self.stabiliser.known) == len(self.context.timeline)

    def _still(self) -> tuple[Rigid | None, ...]:
        """The motion of each frame to the reference; None where it is not known."""
        known, count = self.stabiliser.known, len(self.context.timeline)

        def make() -> tuple[Rigid | None, ...]:
            found = (known.get(frame) for frame in range(count))
            return tuple(None if one is None or one.motion is None else one.motion.inverse for one in found)

        return self._cached.of("still", (known,), make)

    def _motion(self, frame: int) -> Rigid:
        """The motion of a frame to where it is shown: a gap is shown as recorded."""
        still = self._still()
        return still[frame] or STILL

    def _curves(self) -> Mapping[str, Series]:
        """The curves of the motion that the user wants plotted."""
        motions, known, times = self.stabiliser.motions, self.stabiliser.known, self.context.timeline.times
        up, front = self.context.document.look.up, self.context.document.front

        def make() -> Mapping[str, Series]:
            if motions is None or motions.reference is None or not known:
                return {}
            return motion_curves(known, times, motions.reference.middle, anatomical_axes(up, front))

        found = self._cached.of(("curves", up, front), (motions, known, times), make)
        settings: Settings = self.context.settings
        wanted = (
            (settings.rotations, TURNS),
            (settings.translations, SHIFTS),
            (settings.residual, [RESIDUAL]),
        )
        return {name: found[name] for is_on, names in wanted if is_on and found for name in names}

    # --- in the window ----------------------------------------------------------------

    @property
    def facts(self) -> Facts:
        """The lines on the motions that are known."""
        motions, known, scale = self.stabiliser.motions, self.stabiliser.known, self.context.scale
        up, front = self.context.document.look.up, self.context.document.front

        def make() -> Facts:
            # Axes need scipy, which the thread that finds the region may be importing until that is there.
            if motions is None or motions.reference is None:
                return Facts()
            return facts_of(motions, known, anatomical_axes(up, front), scale)

        return self._cached.of(("facts", up, front, scale), (motions, known), make)

    def panel(self, ui: Ui) -> None:
        """Declare the section of the panel."""
        panel.draw(self, ui)

    def drawn(self, frame: int) -> DrawnMarks:
        """How a frame of a saved picture was stabilised."""
        if self.context.followed.still is None:
            return NOTHING_DRAWN
        choices, is_gap = self.choices, self.context.followed.still[frame] is None
        return DrawnMarks(stabilised=Stabilised(choices.words, choices.reference, is_gap))

    def spans(self) -> list[FrameSpan]:
        """The gaps, while the scan is shown stabilised."""
        known = self.stabiliser.known
        return (
            self._cached.of("spans", (known,), lambda: motion_gap_spans(known))
            if self.choices.is_shown
            else []
        )


def _brush(name: str, title: str, short: str, key: str, icon: str, erasing: bool) -> Command:
    """A command that takes up the brush or the eraser. The toolbar has both while the region is painted."""
    return Command(
        name, title, lambda tool: tool.paint(erasing=erasing), key,
        is_on=lambda tool: tool.painting.is_on and tool.painting.is_erasing == erasing,
        can=lambda tool: len(tool.context.timeline) > 1 and not (erasing and tool.painting.is_empty),
        is_there=lambda tool: tool.painting.is_on or tool.choices.region == PAINTED,
        short=short, icon=icon,
    )  # fmt: skip


COMMANDS = {
    "Tools": (
        Command(
            "stabilise", "Stabilise", Tool.toggle, "U",
            is_on=lambda tool: tool.choices.is_shown, can=lambda tool: len(tool.context.timeline) > 1,
            short="Stabilise", icon=icons.ICON_FA_ANCHOR,
        ),
        Command(
            "distance_colors", "Colour by distance from reference", Tool.toggle_colors, "Shift+U",
            is_on=lambda tool: tool.is_colored, can=lambda tool: len(tool.context.timeline) > 1,
        ),
        _brush("paint_region", "Paint rigid region", "Paint", "Shift+G", icons.ICON_FA_PAINTBRUSH, False),
        _brush("erase_region", "Erase from rigid region", "Erase", "Shift+E", icons.ICON_FA_ERASER, True),
    )
}  # fmt: skip
MOUSE = (
    ("Drag, while painting a region", "Add the surface under the brush to the rigid region"),
    ("Drag, while erasing", "Remove the surface under the eraser from the region"),
)
