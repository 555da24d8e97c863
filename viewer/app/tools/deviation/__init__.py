"""Deviation: signed distances of each frame from a reference, as colours, numbers and curves."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from imgui_bundle import icons_fontawesome_6 as icons
from numpy.typing import NDArray

from ....analysis.deviation.chosen import NAME
from ....analysis.deviation.over_time import deviation_curves
from ....analysis.measures import Series
from ....files import working_folder
from ....output.overlays import NOTHING_DRAWN, DeviationMarks, DrawnMarks
from ....scan.formats import known_suffixes
from ....scan.pose import Pose
from ...commands import Command
from ...file_dialog import OPEN, FileDialog
from ...tool_context import ToolContext
from ...ui import Ui
from .._cached import Cached
from .._colored import Colored, rounded_up
from .._frame_numbers import FrameNumbers
from .._painting import Painted, Painting, PaintingTool, Sphere
from . import panel
from .choices import FILE, Deviating
from .finder import DeviationFinder

TITLE = "Deviation"
RANK = 1  # below the tools that it builds on
_FIRST_END = 0.01  # of the scan's radius: where the colour map ends before deviations are known

Values = NDArray[np.float32]


class Tool(PaintingTool):
    """The tool that measures deviations. finder: has statistics found. numbers: has deviations of frames in
    memory found. colored: sets their colours. painting: the brush that paints the region. choosing: the
    dialog that chooses the other scan."""

    def __init__(self, context: ToolContext) -> None:
        self.context = context
        self.finder = DeviationFinder(context)
        self.numbers = FrameNumbers[Values](context, "Colouring by deviation", _unknown)
        self.colored = Colored(context, {NAME: True})
        self.painting = Painting(
            context,
            Painted(
                "measured region", lambda: self.choices.first, lambda: self.choices.spheres, self._paint,
                "Drag over the part whose deviations you want.",
            ),
        )  # fmt: skip
        about = "A scan or a mesh. Of a file with several frames, the first one counts"
        self.choosing = FileDialog(
            OPEN, "Choose reference", about, known_suffixes(), self._take_file, context.redraw
        )
        self.cached = Cached()
        self._laid: tuple[object, ...] = ()

    @property
    def choices(self) -> Deviating:
        """The choices about the open scan."""
        return self.context.document.part(Deviating)

    def choose(self, step: str, *, merge: bool = False, **changes: Any) -> None:
        """Change choices. step: what Undo calls it. merge: with the same change just before."""
        self.context.change(step, self.choices.changed(**changes), merge=step if merge else None)

    @property
    def frame(self) -> int:
        """The frame that is shown."""
        return self.context.index if self.context.pose is None else self.context.pose.index

    def toggle(self) -> None:
        """Measure deviations and colour the scan by them, or do neither."""
        if self.choices.is_on:
            self.choose("Hide deviation", is_on=False)
            if self.colored.name:
                self.colored.reset()
            return
        self.show_colors()
        self.context.reveal()

    def show_colors(self) -> None:
        """Colour the scan by deviations, for which they are measured."""
        choices, end = self.choices.changed(is_on=True), self._end or self._first_end
        self.colored.show("Show deviation", NAME, end, choices)
        self.finder.resume()
        self._lay()  # the numbers, not known yet, are there before the next picture asks for them

    def ask_for_file(self) -> None:
        """Open the dialog that chooses the other scan."""
        file = self.choices.file
        self.choosing.ask(Path(file) if file and Path(file).parent.is_dir() else working_folder())

    def _take_file(self, file: Path) -> None:
        self.choose("Choose reference", kind=FILE, file=str(file))
        self.finder.resume()

    def _paint(self, step: str, spheres: tuple[Sphere, ...]) -> None:
        self.choose(step, spheres=spheres)

    @property
    def _first_end(self) -> float:
        pose = self.context.pose
        return 1.0 if pose is None else rounded_up(_FIRST_END * self.context.viewport.bounds(pose).radius)

    @property
    def _end(self) -> float | None:
        """The end of the colour map: 95 % of the deviations of each frame are below it; None where none is
        known."""
        sizes = [one.whole.p95 for one in self.finder.known.values() if np.isfinite(one.whole.p95)]
        work = self.finder.work
        if not sizes or work is None or work.deviations is None:
            return None
        return rounded_up(max(*sizes, 1e-3 * work.deviations.reach))

    def advance(self, budget: float) -> bool:
        """Have deviations found, and the scan coloured by them; whether there is something new."""
        choices = self.choices
        is_new = self.finder.advance(choices.reference, choices.spheres, choices.is_on)
        if self.colored.name:
            self._color()
            self.colored.fit(NAME, self.cached.of("end", (self.finder.known,), lambda: self._end))
        self.context.followed.curves[self.context.name] = self._curves()
        return self._lay() or is_new

    def _color(self) -> None:
        """Have deviations of frames in memory found."""
        work = self.finder.work
        deviations = None if work is None else work.deviations
        if work is None or deviations is None:
            self.numbers.advance({}, _unknown)
            return
        places = work.places

        def find(pose: Pose) -> Values:
            return deviations.of(pose.cloud, places[pose.index].to_reference)

        self.numbers.advance({frame: (deviations, place.key) for frame, place in places.items()}, find)

    def values(self) -> Values | None:
        """The deviations of the frame that is shown, (N,); None where they are not known, or not shown."""
        pose = self.context.playback.pose
        return None if pose is None or not self.colored.name else self.numbers.of(pose)

    def _curves(self) -> Mapping[str, Series]:
        known, times = self.finder.known, self.context.timeline.times

        def make() -> Mapping[str, Series]:
            return deviation_curves(known, times) if known else {}

        return self.cached.of("curves", (known, times), make)

    def _lay(self) -> bool:
        """Lay the numbers over the frame that is shown; whether others than before."""
        values = self.values()
        wanted = (self.context.timeline, self.choices.is_on, values is not None and id(values))
        if wanted == self._laid:
            return False
        self._laid = wanted
        self.context.lay(self._numbers)  # also without a colour: Undo may bring one back
        return True

    def _numbers(self, pose: Pose) -> Mapping[str, NDArray[Any]]:
        is_laid = self.choices.is_on or self.colored.name
        return {NAME: self.numbers.of(pose)} if is_laid else {}

    def drawn(self, frame: int) -> DrawnMarks:
        """How the deviations of a frame of a saved picture are found again."""
        reference = self.choices.reference
        if not self.colored.name or reference is None:
            return NOTHING_DRAWN
        place = self.finder.places(reference).get(frame)
        return DrawnMarks(deviation=DeviationMarks(reference, None if place is None else place.to_reference))

    def panel(self, ui: Ui) -> None:
        """Declare the section of the panel."""
        panel.draw(self, ui)

    def dialog(self) -> None:
        """Declare the dialog that chooses the other scan, while it is open."""
        self.choosing.draw()


def _unknown(pose: Pose) -> Values:
    return np.full(len(pose.cloud), np.nan, np.float32)


COMMANDS = {
    "Tools": (
        Command(
            "deviation", "Show deviation", Tool.toggle, "Shift+M",
            is_on=lambda tool: tool.choices.is_on, short="Deviation", icon=icons.ICON_FA_RIGHT_LEFT,
        ),
    )
}  # fmt: skip
