"""Measures over time, plotted under the timeline, and the paths of landmarks over the picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons
from numpy.typing import NDArray

from ....analysis.measures import Measure
from ....analysis.measures.curves import NUMBER_COLUMNS, number_rows, numbers_file
from ....csv_text import save_rows, to_text
from ....document.landmarks import Landmarks
from ....errors import InputError
from ....output.overlays import NOTHING_DRAWN, DrawnMarks
from ....output.plots import PLOT_SUFFIXES, CurvePlot
from ....scan.inputs import refuse_input
from ... import widgets
from ...commands import Command, Menu
from ...file_dialog import SAVE, FileDialog
from ...scene.canvas import Canvas, ScreenView
from ...tool_context import Click, ToolContext
from ...ui import Ui
from .._cached import Cached
from . import panel, plot
from .adding import Adding
from .choices import CurveChoices, Settings
from .lasso import Lasso
from .lines import MeasureLines
from .measurer import Measurer
from .paths import Paths
from .shown import Curve, Shown
from .words import numbers_in_words

TITLE = "Measures over time"


class Tool:
    """The tool that plots measures over time, and draws the paths of landmarks.

    shown: what is plotted. paths, lines: what is drawn over the picture. lasso: draws regions. adding: the
    measure that is to be added. measurer: what finds measures over time. pointed: the curve that the mouse
    points at in the table, by name.

    The class has more than 30 methods because each hook of a tool and each of its commands is one.
    """

    def __init__(self, context: ToolContext) -> None:
        self.context = context
        self.shown = Shown()
        self.paths = Paths(context)
        self.lines = MeasureLines(context)
        self.adding = Adding()
        self.lasso = Lasso(context)
        self.measurer = Measurer(context)
        self.pointed: str | None = None
        self.renaming = widgets.NameField()
        self.saving = FileDialog(
            SAVE, "Export plot", "A table (.csv) or a picture (.png, .svg) of the plot",
            PLOT_SUFFIXES, self._save, context.redraw,
        )  # fmt: skip
        self._words = Cached()
        self._fitted: object = None  # what the axes were fitted to last

    @property
    def settings(self) -> Settings:
        """The choices whatever the scan."""
        settings: Settings = self.context.settings
        return settings

    @settings.setter
    def settings(self, settings: Settings) -> None:
        self.context.settings = settings

    @property
    def choices(self) -> CurveChoices:
        """The choices about the open scan."""
        return self.context.document.part(CurveChoices)

    def choose(self, step: str, **changes: Any) -> None:
        """Change choices about the open scan. step: what Undo calls it."""
        self.context.change(
            step, replace(self.choices, **changes), merge=(step, *changes) if "noise" in changes else None
        )

    @property
    def landmarks(self) -> Landmarks:
        """The landmarks of the open scan, and the measures of them."""
        return self.context.document.part(Landmarks)

    @property
    def placed(self) -> list[str]:
        """The names of the landmarks that are placed, in their order."""
        return [landmark.name for landmark in self.landmarks.listed if landmark.state == "placed"]

    @property
    def unseen(self) -> tuple[str, ...]:
        """The measures whose lines the view does not show: it always shows distances that own their ends."""
        measures, hidden, is_shown = self.landmarks.measures, self.choices.hidden, self.settings.lines

        def find() -> tuple[str, ...]:
            unseen = (one.name for one in measures if not is_shown or one.name in hidden)
            return tuple(set(unseen) - {one.name for one in self.landmarks.distances})

        found: tuple[str, ...] = self._words.of("unseen", (measures, hidden, is_shown), find)
        return found

    @property
    def times(self) -> NDArray[np.float64]:
        """(T,) seconds, of the scan's frames."""
        return self.context.timeline.times

    # --- the drawer -------------------------------------------------------------------

    def toggle(self) -> None:
        """Show the curves, or put them away."""
        self.settings = replace(self.settings, is_open=not self.settings.is_open)
        self.context.redraw()

    def is_below(self) -> bool:
        """Whether curves are shown under the timeline."""
        return self.settings.is_open

    def is_bare(self) -> bool:
        """Whether there is nothing to plot yet: the drawer is then as low as its words."""
        return not self.landmarks.measures and not any(self.context.followed.curves.values())

    def below(self, ui: Ui) -> None:
        """Declare the curves under the timeline."""
        plot.draw(self, ui)

    def update(self) -> None:
        """Find what is plotted now."""
        paths = self.paths.trajectories(self.settings, self.choices)
        count = len(self.times)
        fitting = {
            name: one for name, one in self.context.followed.all_curves.items() if len(one.times) == count
        }  # not of a scan before
        self.shown.take(fitting, self.choices, self.settings, self.context.scale, paths)

    def fit(self) -> None:
        """Have the axes show all of the curves."""
        self._fitted = None

    def takes_fit(self, shown: CurvePlot) -> bool:
        """Whether the axes are to be fitted, once: to other curves, or to ones that are still being found."""
        kind = (
            self.context.scan,
            self.settings.mode,
            self.settings.order,
            *(line.label for line in shown.drawn),
        )
        now = (shown, kind) if self.context.followed.is_busy else (None, kind)
        is_due = self._fitted is None or self._fitted != now
        self._fitted = now
        return is_due

    def words_of(self, curve: Curve) -> tuple[str, ...]:
        """The numbers of a curve, in words."""
        return self._words.of(curve.name, (curve,), lambda: numbers_in_words(curve))

    # --- measures ---------------------------------------------------------------------

    def add(self, measure: Measure) -> None:
        """Measure something, and show its curve. Raises InputError where one has that name already."""
        if any(one.name == measure.name for one in self.landmarks.measures):
            raise InputError(f"A measure '{measure.name}' exists already.")
        measures = (*self.landmarks.measures, measure)
        self.context.change("Add measure", replace(self.landmarks, measures=measures))
        self.settings = replace(self.settings, is_open=True)

    def delete(self, name: str) -> None:
        """Delete a measure."""
        self.context.change("Delete measure", self.landmarks.without_measures([name]))

    def rename(self, old: str, new: str) -> None:
        """Give a measure another name. Raises InputError for one that is taken."""
        new = new.strip()
        if not new or new == old:
            return
        if any(one.name == new for one in self.landmarks.measures):
            raise InputError(f"A measure '{new}' exists already. Choose another name.")
        made = self.landmarks.with_measure_renamed(old, new)
        self.context.change("Rename measure", made, self.choices.with_measure_renamed(old, new))

    def measure_distance(self) -> None:
        """Measure the distance of the two landmarks that stand last among those that are placed."""
        measures = [one.name for one in self.landmarks.measures]
        measure = Adding().measure(self.placed, measures)
        if measure is None:
            raise InputError("A distance needs two landmarks: place them first.")
        self.add(measure)

    # --- regions ----------------------------------------------------------------------

    def prompt(self) -> str:
        """The words that say what a drag does."""
        return self.lasso.prompt()

    def on_click(self, click: Click) -> bool:
        """A click goes round nothing."""
        return False

    def on_press(self, mouse: ImVec2) -> bool:
        """Whether a drag draws a region."""
        return self.lasso.is_drawn

    def on_drag(self, click: Click, ends: bool) -> None:
        """Draw round a region, and measure it where the button is let go of."""
        self.lasso.take(click, ends)

    def on_escape(self) -> bool:
        """Put the lasso away; whether it was there."""
        return self.lasso.put_away()

    def is_under_way(self) -> bool:
        """Whether a region is being drawn."""
        return self.lasso.is_under_way

    def abandon(self) -> None:
        """Let go of the region that is being drawn."""
        self.lasso.abandon()

    # --- in the window ----------------------------------------------------------------

    def panel(self, ui: Ui) -> None:
        """Declare the section of the panel."""
        panel.draw(self, ui)

    def overlay(self, canvas: Canvas, view: ScreenView) -> None:
        """Draw the paths of landmarks, what is measured in the frame, and the region that is being drawn."""
        self.paths.draw(self.settings, self.choices, canvas, view)
        self.lines.draw(self.landmarks, self.unseen, self.pointed, canvas, view)
        self.lasso.draw(canvas, view)

    def drawn(self, frame: int) -> DrawnMarks:
        """The paths of landmarks and what is measured over a frame, for pictures that are saved."""
        pose = self.context.pose
        if pose is None:
            return NOTHING_DRAWN
        radius = self.context.viewport.bounds(pose).radius
        found = self.paths.drawn(self.settings, self.choices, frame, radius)
        if self.is_below() and self.shown.plot is not None:
            found = replace(found, plot=self.shown.plot.drawn_below())
        lines = self.lines.drawn(self.landmarks, self.unseen, frame, radius)
        return replace(found, measure_lines=lines)

    def advance(self, budget: float) -> bool:
        """Measure what is left to be measured, and have the scan held still by its anchors where that is
        chosen; whether there is something new."""
        has_measured = self.measurer.advance(budget, self.choices.noise)
        return self.paths.hold(self.settings, self.choices) or has_measured

    def toggle_paths(self) -> None:
        """Draw the paths of the landmarks that are ticked, or not."""
        self.settings = replace(self.settings, trajectories=not self.settings.trajectories)

    def toggle_head_motion(self) -> None:
        """Show the scan with the motion of the rigid references removed, or as it was recorded."""
        self.settings = replace(self.settings, hold=not self.settings.hold)
        if self.settings.hold and self.paths.still(self.choices) is None and self.paths.problem:
            self.context.note(self.paths.problem)

    def show_lines(self) -> None:
        """Draw what is measured in the view, or not."""
        self.settings = replace(self.settings, lines=not self.settings.lines)

    def dialog(self) -> None:
        """Declare the dialog that names a file, while it is open."""
        self.saving.draw()

    # --- out of the window ------------------------------------------------------------

    def copy(self) -> None:
        """Put what is plotted into the clipboard, as a table for spreadsheets."""
        if self.shown.plot is not None:
            imgui.set_clipboard_text(to_text(self.shown.plot.rows(), "\t"))
            self.context.note(f"Copied {len(self.shown.plot.lines)} curves as a table.")

    def copy_numbers(self) -> None:
        """Put amplitude, onset, peak and duration of each curve into the clipboard, as a table."""
        rows = [NUMBER_COLUMNS, *number_rows(self.shown.curves)]
        imgui.set_clipboard_text(to_text(rows, "\t"))
        self.context.note(
            f"Copied amplitude, onset, peak and duration of {len(self.shown.curves)} curves as a table."
        )

    def ask_to_save(self) -> None:
        """Open the dialog that saves, with a name that is free."""
        self.saving.ask(self.context.free_file(f"_measures{PLOT_SUFFIXES[0]}"))

    def _save(self, file: Path) -> None:
        """Save what is plotted; beside a table, the numbers of the movements as another one."""
        shown, curves = self.shown.plot, self.shown.curves
        if shown is None:
            raise InputError("There are no curves to save.")
        files = [file, numbers_file(file)] if file.suffix.lower() == ".csv" else [file]
        for path in files:
            refuse_input(path, self.context.timeline)

        def save() -> None:
            shown.save(file)
            for path in files[1:]:
                save_rows(path, [NUMBER_COLUMNS, *number_rows(curves)])

        words = f"Saved {' and '.join(map(str, files))}"
        self.context.run(f"Saving {file.name}", save, lambda _: self.context.note(words))


def _with_plot(name: str, title: str, act: Callable[[Tool], None]) -> Command:
    """A command that does something with what is plotted."""
    return Command(name, title, act, can=lambda tool: tool.is_below() and tool.shown.plot is not None)


COMMANDS = {
    "Tools": (
        Command(
            "curves", "Plot measures", Tool.toggle, "V",
            is_on=Tool.is_below, short="Measures over time", icon=icons.ICON_FA_CHART_LINE,
        ),
        Menu("Plot options", (
            (
                Command(
                    "measure_distance", "Distance between last two landmarks", Tool.measure_distance, "D"
                ),
                Command(
                    "lasso", "Outline a region", lambda tool: tool.lasso.toggle(),
                    is_on=lambda tool: tool.lasso.is_drawn,
                ),
                Command(
                    "trajectories", "Landmark paths", Tool.toggle_paths, "W",
                    is_on=lambda tool: tool.settings.trajectories,
                ),
                Command(
                    "head_motion", "Remove head motion", Tool.toggle_head_motion,
                    is_on=lambda tool: tool.settings.hold, can=lambda tool: bool(tool.choices.anchors),
                ),
                Command(
                    "measure_lines", "Show measures in the view", Tool.show_lines,
                    is_on=lambda tool: tool.settings.lines,
                ),
            ),
            (
                _with_plot("copy_curves", "Copy as table", Tool.copy),
                _with_plot("copy_numbers", "Copy numbers", Tool.copy_numbers),
                _with_plot("save_curves", "Export plot...", Tool.ask_to_save),
            ),
        )),
    )
}  # fmt: skip
MOUSE = (
    ("Drag, after Outline a region", "Measure the area and the perimeter inside the outline"),
    ("Drag the line in the plot, or click in the plot", "Go to that frame"),
    ("Wheel, drag, right drag, double click in a plot", "Zoom, move, zoom to a box, show all"),
)
