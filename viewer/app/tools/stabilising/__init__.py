"""Stabilising: the motion of a part that stays rigid, such as the head, is removed from what is shown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from imgui_bundle import icons_fontawesome_6 as icons

from ....analysis.motion.axes import anatomical_axes
from ....document.landmarks import Landmarks
from ....errors import InputError
from ....geometry import Vector
from ....rigid import STILL, Rigid
from ...commands import Command
from ...tool_context import FrameSpan, ToolContext
from ...ui import Ui
from .._cached import Cached
from . import panel
from .choices import Stabilising
from .stabiliser import Asked, Stabiliser
from .words import Facts, facts_of, motion_gap_spans

TITLE = "Stabilise"


class Tool:
    """The tool that stabilises the scan. stabiliser: has motions found."""

    def __init__(self, context: ToolContext) -> None:
        self.context = context
        self.stabiliser = Stabiliser(context)
        self._cached = Cached()
        self._laid: tuple[object, ...] = ()

    @property
    def choices(self) -> Stabilising:
        """The choices about the open scan."""
        return self.context.document.part(Stabilising)

    def choose(self, step: str, **changes: Any) -> None:
        """Change choices. step: what Undo calls it."""
        self.context.change(step, replace(self.choices, **changes))

    @property
    def frame(self) -> int:
        """The frame that is shown."""
        return self.context.index if self.context.pose is None else self.context.pose.index

    def toggle(self) -> None:
        """Show the scan stabilised, or as recorded. Raises InputError for a scan of one frame."""
        if len(self.context.timeline) < 2:
            raise InputError("The scan has one frame, so there is no motion to remove.")
        is_shown = not self.choices.is_shown
        self.choose("Stabilise" if is_shown else "Show as recorded", is_shown=is_shown)
        if is_shown:
            self.stabiliser.resume()
            self.context.reveal()

    @property
    def _places(self) -> Mapping[str, Vector]:
        """The places of the region's landmarks in the reference frame, as far as the user set them there."""
        choices = self.choices
        named = {one.name: one for one in self.context.document.part(Landmarks).all}
        keys = {name: named[name].key_at(choices.reference) for name in choices.landmarks if name in named}
        return {name: key.position for name, key in keys.items() if key is not None}

    def advance(self, budget: float) -> bool:
        """Have motions found, and the scan shown by them; whether there is something new."""
        choices = self.choices
        asked = Asked.of(self.context.timeline, self.context.unit, choices, self._places)
        is_new = self.stabiliser.advance(asked, choices.is_shown)
        return self._lay() or is_new

    def _lay(self) -> bool:
        """Move the scan by what is known of the frame that is shown; whether that has changed something."""
        known, is_shown = self.stabiliser.known, self.choices.is_shown and bool(self.stabiliser.known)
        self.context.followed.still = self._still() if is_shown else None
        wanted = (self.context.timeline, is_shown and known.get(self.frame), is_shown and self._is_whole)
        if wanted == self._laid:
            return False
        self._laid = wanted
        self.context.lay(motion=self._motion if is_shown else None)
        return True

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

    def spans(self) -> list[FrameSpan]:
        """The gaps, while the scan is shown stabilised."""
        known = self.stabiliser.known
        return (
            self._cached.of("spans", (known,), lambda: motion_gap_spans(known))
            if self.choices.is_shown
            else []
        )


COMMANDS = {
    "Tools": (
        Command(
            "stabilise", "Stabilise", Tool.toggle, "U",
            is_on=lambda tool: tool.choices.is_shown, can=lambda tool: len(tool.context.timeline) > 1,
            short="Stabilise", icon=icons.ICON_FA_ANCHOR,
        ),
    )
}  # fmt: skip
