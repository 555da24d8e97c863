"""Distances between places that are clicked; they follow their points, and are kept with the scan."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from ....analysis.measure import Measurement, Reading, reading_of, readings_in_frames, table
from ....analysis.measured_table import is_measurement_table, read_measurements
from ....analysis.pick import is_seen
from ....analysis.spot import Spot, spot_slack
from ....csv_text import save_rows, to_text
from ....document.measurements import Measurements
from ....errors import InputError
from ....files import working_folder
from ....scan.inputs import refuse_input
from ....scan.timeline import Timeline
from ...commands import Command, Menu
from ...read_dialog import ReadDialog
from ...save_dialog import SaveDialog
from ...scene.canvas import Canvas, ViewPlace
from ...tool_context import Click, ToolContext
from ...ui import Ui
from . import overlay, panel
from .words import distance_words

log = logging.getLogger(__name__)
TITLE = "Distances (this frame)"


class Tool:
    """The tool that measures. What was measured is in the document.

    begun: the first end of the one that is being made, None where none is. filled: whether ends may be set
    where holes are filled. saving, reading: dialogs that name a file.
    """

    def __init__(self, context: ToolContext) -> None:
        self.context = context
        self.filled = False
        about = "All distances, as a table of comma separated values"
        self.saving = SaveDialog("Export distances", about, ".csv", self._save, context.redraw)
        about = "A table that 'Export distances...' has written of this scan"
        self.reading = ReadDialog("Import distances", about, ".csv", self._read, context.redraw)
        self.begun: Spot | None = None
        self._seen: tuple[object, dict[Spot, bool]] = None, {}
        self._told: list[str] = []
        self._learned: Timeline | None = None  # the last that was asked whether points can be followed
        self._followed = ""  # the scan that was found to have one topology, last

    @property
    def made(self) -> Measurements:
        """The measurements of the open scan."""
        return self.context.document.part(Measurements)

    def delete(self, number: int) -> None:
        """Take away the one at this place, counted from 0."""
        self.context.change("Delete distance", self.made.without(number))

    def clear(self) -> None:
        """Take away all."""
        self.context.change("Clear distances", Measurements())

    @property
    def is_active(self) -> bool:
        """Whether clicks in the view set ends."""
        return self.context.has_clicks

    def toggle(self) -> None:
        """Take up the tool or put it away; a measurement that was begun goes with it."""
        self.begun = None
        if self.is_active:
            self.context.leave_clicks()
        else:
            self.context.take_clicks()
            self.context.reveal()
        log.debug("measuring %s", "begins" if self.is_active else "ends")

    def on_escape(self) -> bool:
        """Put the tool away; whether it was taken up."""
        was_active = self.is_active
        if was_active:
            self.toggle()
        return was_active

    def is_under_way(self) -> bool:
        """Whether a measurement was begun."""
        return self.begun is not None

    def abandon(self) -> None:
        """Let go of a measurement that was begun."""
        self.begun = None

    def prompt(self) -> str:
        """The words that say what a click does."""
        return f"Measuring: click the {'second' if self.begun else 'first'} point. Esc to stop."

    def on_click(self, click: Click) -> bool:
        """Set an end at what was clicked; raises InputError where it cannot be."""
        if click.picked is None:
            raise InputError("No surface here: click on the scan.")
        end = Spot.of(click.picked, click.pose, filled=self.filled, place=click.motion)
        if click.through_gap:
            self.context.note("No data there: placed on the nearest surface in front.")
        log.debug("end at %s: %s, frame %d", *_place_words(end), end.frame)
        self.set_end(end)
        _learn_topology(self.context.timeline, click.pose.index)
        return True

    def panel(self, ui: Ui) -> None:
        """Declare the section of the panel."""
        panel.draw(self, ui)

    def dialog(self) -> None:
        """Declare the dialogs that name a file, while one is open."""
        self.saving.draw()
        self.reading.draw()

    def overlay(self, canvas: Canvas, view: ViewPlace) -> None:
        """Draw what was measured, and tell what changes by it."""
        readings = self.readings()
        self.watch(readings)
        overlay.draw(self, readings, canvas, view)

    def set_end(self, end: Spot) -> None:
        """Begin a measurement, or complete the one that was begun.

        An end at the very place and frame of the first, as a second click of a double click sets it, changes
        nothing.
        """
        first, self.begun = self.begun, None
        if first is None or (first.frame, first.position) == (end.frame, end.position):
            self.begun = first or end
            return
        made = Measurement(first, end)
        self.context.change("Measure", self.made.added(made))
        self.context.reveal()
        log.debug("measured %r, uncertainty %r", made.distance, made.uncertainty)

    def readings(self) -> list[Reading]:
        """The measurements as they stand in the frame that is shown; none before the first."""
        pose, one_topology = self.context.pose, self.context.timeline.one_topology
        if pose is None:
            return []
        motion = self.context.motion(pose)
        return [reading_of(measurement, pose, one_topology, motion) for measurement in self.made.all]

    def watch(self, readings: Sequence[Reading]) -> None:
        """Tell when measurements that followed their points no longer can; note in the log what they read."""
        scan, timeline = self.context.scan, self.context.timeline
        one_topology = timeline.one_topology
        if readings and self._learned is not timeline:  # opened again, with measurements of before
            self._learned = timeline
            _learn_topology(timeline, self.context.index)
        if one_topology:
            self._followed = scan
        elif self._followed == scan and one_topology is False:
            self._followed = ""
            if readings:
                self.context.note("Not all frames have the same points: distances stay fixed in space.")
        told = [f"{distance_words(reading, self.context.scale)}, {reading.motion}" for reading in readings]
        if told != self._told:
            self._told = told
            log.debug("measurements: %s", "; ".join(told) or "none")

    def is_seen(self, end: Spot) -> bool:
        """Whether an end is in the picture and not behind what that shows; found once a picture."""
        surface, shown = self.context.viewport.surface, self.context.viewport.request
        if surface is None or shown is None or not self.context.viewport.is_there:
            return True
        if self._seen[0] is not shown:
            self._seen = shown, {}
        known = self._seen[1]
        if end not in known:
            slack = spot_slack(end, self.context.viewport.bounds(shown.pose).radius)
            known[end] = is_seen(surface, end.position, slack)
        return known[end]

    # --- out of the window ------------------------------------------------------------

    def copy(self) -> None:
        """Put a table of all into the clipboard, for spreadsheets."""
        imgui.set_clipboard_text(to_text(self._table(), "\t"))
        self.context.note(f"Copied {len(self.made.all)} distances as a table.")

    def ask_to_save(self) -> None:
        """Open the dialog that saves, with a name that is free."""
        self.saving.ask(self.context.free_file("_distances.csv"))

    def _save(self, file: Path) -> None:
        timeline, pose = self.context.timeline, self.context.pose
        refuse_input(file, timeline)
        is_still = pose is None or self.context.motion(pose).is_identity
        if not (timeline.one_topology and len(timeline) > 1 and is_still):
            save_rows(file, self._table())
            self.context.note(f"Saved {file}")
            return
        made, scale = self.made.all, self.context.scale

        def save_all_frames() -> None:
            rows = readings_in_frames(made, len(timeline), timeline.visit, one_topology=True)
            save_rows(file, table(rows, timeline.name, scale.unit, scale.factor))

        told = f"Saved {file}, in all {len(timeline)} frames"
        self.context.run(f"Saving {file.name}", save_all_frames, lambda _: self.context.note(told))

    def ask_to_read(self) -> None:
        """Open the dialog that reads measurements back."""
        self.reading.ask(working_folder())

    def _read(self, file: Path) -> None:
        if not self.on_file(file):
            raise InputError("holds no distances", file, "Choose a table that 'Export distances...' wrote")

    def on_file(self, path: Path) -> bool:
        """Add the measurements of a table that was saved of this scan, but those that are there; whether the
        file is such a table."""
        if not is_measurement_table(path):
            return False
        pose, timeline = self.context.pose, self.context.timeline
        if pose is not None and not self.context.motion(pose).is_identity:
            self.context.note("The scan is moved: turn off Remove head motion, then open the table again.")
            return True
        work = partial(
            read_measurements, path, timeline.name, self.context.unit, len(timeline), timeline.pose
        )
        self.context.run(f"Reading {path.name}", work, self._add)
        return True

    def _add(self, read: Sequence[Measurement]) -> None:
        known = {_places(measurement) for measurement in self.made.all}
        new = tuple(measurement for measurement in read if _places(measurement) not in known)
        if new:
            self.context.change("Import distances", Measurements((*self.made.all, *new)))
            self.context.reveal()
        there = f", {len(read) - len(new)} exist already" if len(new) < len(read) else ""
        self.context.note(f"Imported {len(new)} distances{there}.")

    def _table(self) -> list[list[object]]:
        """Each measurement as it was made; and where it follows its points, as it stands in another frame."""
        rows: list[tuple[int, Reading]] = []
        for number, (made, reading) in enumerate(zip(self.made.all, self.readings(), strict=True), 1):
            rows.append((number, Reading(made, reading.fixed)))
            if reading.measurement != made:
                rows.append((number, reading))
        scale = self.context.scale
        return table(rows, self.context.timeline.name, scale.unit, scale.factor)


def _places(measurement: Measurement) -> tuple[object, ...]:
    """The frames and places of the ends, to a millionth of their distance: what tells it from others."""
    digits = 6 - math.floor(math.log10(measurement.distance or 1))
    return tuple((end.frame, *(round(x, digits) for x in end.position)) for end in measurement.ends)


def _place_words(end: Spot) -> tuple[str, str]:
    return ", ".join(map(repr, end.position)), "surface" if end.id is None else f"at point {end.id}"


def _learn_topology(timeline: Timeline, index: int) -> None:
    """Have a second frame read where only one is known, since that tells whether points can be followed."""
    if timeline.one_topology is None and len(timeline) > 1:
        timeline.request((index + 1) % len(timeline))
        timeline.request(index)


def _at_all(name: str, title: str, act: Callable[[Tool], None]) -> Command[Tool]:
    """A command that does something with all measurements."""
    return Command(f"{name}_measurements", title, act, can=lambda tool: bool(tool.made.all))


COMMANDS = {
    "Tools": (
        Command(
            "measure", "Measure distance", Tool.toggle, "M",
            is_on=lambda tool: tool.is_active, can=lambda tool: tool.context.document.camera is not None,
            short="Distances", icon=icons.ICON_FA_RULER,
        ),
        Menu("Distances", (
            (
                _at_all("copy", "Copy as table", Tool.copy),
                _at_all("save", "Export distances...", Tool.ask_to_save),
                Command("read_measurements", "Import distances...", Tool.ask_to_read),
                _at_all("clear", "Clear", Tool.clear),
            ),
        )),
    )
}  # fmt: skip
MOUSE = (("Click while measuring", "Set an end point"),)
