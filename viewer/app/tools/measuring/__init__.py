"""Distances between two clicked points: two landmarks each, which are tracked, and a measure of them."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from ....analysis.measures import Measure
from ....analysis.measures.distances import Ends, distance_rows, is_distance_table, read_distances
from ....analysis.surface_point import SurfacePoint
from ....analysis.track import KNOWN_WORDS, Known
from ....analysis.words import measured_in_words
from ....csv_text import save_rows, to_text
from ....document.landmarks import Landmarks
from ....errors import InputError
from ....files import working_folder
from ....geometry import vector
from ....output.overlays import LINE_COLOR
from ....scan.inputs import refuse_input
from ....scan.units import Scale
from ...commands import Command, Menu
from ...file_dialog import OPEN, SAVE, FileDialog
from ...scene.canvas import Canvas, ScreenView
from ...tool_context import Click, ToolContext
from ...ui import Ui
from . import panel

log = logging.getLogger(__name__)
TITLE = "Distances"


class DistanceRow(NamedTuple):
    """A distance in a frame. value, sigma: scan units, NaN where not known. state: whether its ends were
    placed or tracked there, in words, or why they are not known. ends: their keys there, or else first."""

    measure: Measure
    value: float
    sigma: float
    state: str
    ends: tuple[SurfacePoint, ...]

    def words(self, scale: Scale) -> str:
        """The label and the distance, or why it is not known."""
        words = measured_in_words(scale.factor * self.value, scale.factor * self.sigma, scale.unit)
        shown = self.state if math.isnan(self.value) else words
        averaged = ", averaged" if any(end.averaged for end in self.ends) else ""
        return f"{self.measure.label}: {shown}{averaged}"


class Tool:
    """The tool that measures distances. These are in the document, as measures that own their landmarks.

    begun: the first end of the one that is being made, as the scan has it; None where none is. filled:
    whether ends may be set where holes are filled. saving, reading: dialogs that name a file.
    """

    def __init__(self, context: ToolContext) -> None:
        self.context = context
        self.filled = False
        about = "Table of all distances (comma-separated values)"
        self.saving = FileDialog(SAVE, "Export distances", about, (".csv",), self._save, context.redraw)
        about = "A table that you saved with 'Export distances...' for this scan"
        self.reading = FileDialog(OPEN, "Import distances", about, (".csv",), self._read, context.redraw)
        self.begun: SurfacePoint | None = None

    @property
    def made(self) -> Landmarks:
        """The landmarks of the open scan, and the measures of them."""
        return self.context.document.part(Landmarks)

    def delete(self, name: str) -> None:
        """Delete a distance."""
        self.context.change("Delete distance", self.made.without_measures([name]))

    def clear(self) -> None:
        """Delete all distances."""
        names = [measure.name for measure in self.made.distances]
        self.context.change("Clear distances", self.made.without_measures(names))

    @property
    def is_active(self) -> bool:
        """Whether clicks in the view set ends."""
        return self.context.has_clicks

    def toggle(self) -> None:
        """Take up the tool or put it away; a distance that was begun goes with it."""
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
        """Whether a distance was begun."""
        return self.begun is not None

    def abandon(self) -> None:
        """Let go of a distance that was begun."""
        self.begun = None

    def prompt(self) -> str:
        """The words that say what a click does."""
        return f"Measuring: click the {'second' if self.begun else 'first'} point. Esc to stop."

    def on_click(self, click: Click) -> bool:
        """Set an end at what was clicked; raises InputError where it cannot be."""
        end = click.surface_point(filled=self.filled)
        if click.through_gap:
            self.context.note(
                "You clicked on a gap between points. Scan4D used the nearest surface in front of the gap."
            )
        log.debug("end at %r, point %s, frame %d", end.position, end.id, end.frame)
        self.set_end(end)
        return True

    def set_end(self, end: SurfacePoint) -> None:
        """Begin a distance, or complete the one that was begun.

        An end at the very position and frame of the first, as a second click of a double click sets it,
        changes nothing.
        """
        first, self.begun = self.begun, None
        if first is None or (first.frame, first.position) == (end.frame, end.position):
            self.begun = first or end
            return
        self.context.change("Measure", self.made.with_distance([first], [end]))
        self.context.reveal()

    # --- in the window ----------------------------------------------------------------

    def rows(self) -> list[DistanceRow]:
        """The distances in the frame that is shown; none before the first."""
        pose, followed, found = self.context.pose, self.context.followed, []
        for measure in self.made.distances if pose is not None else ():
            ends = self.made.owned_by(measure)
            tracks = [followed.tracks.get(end.name) for end in ends]
            series = followed.series.get(measure.name)
            if pose is None or series is None or pose.index >= len(series.times):
                continue
            known = Known(int(series.known[pose.index]))
            reasons = [track.reasons.get(pose.index, "") for track in tracks if track is not None]
            reason = next(filter(None, reasons), "") if known is Known.GAP else ""
            state = f"{KNOWN_WORDS[known]}: {reason}" if reason else KNOWN_WORDS[known]
            keys = tuple(end.key_at(pose.index) or end.keys[0] for end in ends)
            value, sigma = float(series.values[pose.index]), float(series.sigmas[pose.index])
            found.append(DistanceRow(measure, value, sigma, state, keys))
        return found

    def panel(self, ui: Ui) -> None:
        """Declare the section of the panel."""
        panel.draw(self, ui)

    def dialog(self) -> None:
        """Declare the dialogs that name a file, while one is open."""
        self.saving.draw()
        self.reading.draw()

    def overlay(self, canvas: Canvas, view: ScreenView) -> None:
        """Draw the distance that was begun; others are drawn as all measures are."""
        pose = self.context.pose
        if self.begun is None or pose is None:
            return
        position = self.context.motion(pose).points(np.array(self.begun.position))
        if (start := view.on_screen(vector(position))) is not None:
            if view.is_hovered and self.is_active:
                canvas.line(start, imgui.get_mouse_pos(), LINE_COLOR, 0.7)
            canvas.point(start, LINE_COLOR)

    # --- out of the window ------------------------------------------------------------

    def _table(self, frames: Iterable[int]) -> list[list[object]]:
        made, context, found = self.made, self.context, self.context.followed
        landmarks = {landmark.name: landmark for landmark in made.all}
        return distance_rows(
            made.distances,
            landmarks,
            found.tracks,
            found.series,
            context.timeline.name,
            context.scale,
            frames,
        )

    def copy(self) -> None:
        """Put a table of all into the clipboard, for spreadsheets: as they were placed, and as they are in
        the frame that is shown."""
        keys = {key.frame for end in self.made.all for key in end.keys}
        frames = sorted({*keys, self.context.index} & set(range(len(self.context.timeline))))
        imgui.set_clipboard_text(to_text(self._table(frames), "\t"))
        self.context.note(f"Copied {len(self.made.distances)} distances as a table.")

    def ask_to_save(self) -> None:
        """Open the dialog that saves, with a name that is free."""
        self.saving.ask(self.context.free_file("_distances.csv"))

    def _save(self, file: Path) -> None:
        timeline, tracks = self.context.timeline, self.context.followed.tracks
        refuse_input(file, timeline)
        save_rows(file, self._table(range(len(timeline))))
        ends = [tracks[name] for measure in self.made.distances for name in measure.landmarks]
        gaps = (
            ""
            if all(track.is_whole for track in ends)
            else "; frames that are not tracked yet have no data in the table"
        )
        frames = f", in all {len(timeline)} frames" if len(timeline) > 1 else ""
        self.context.note(f"Saved {file}{gaps or frames}")

    def ask_to_read(self) -> None:
        """Open the dialog that reads distances back."""
        self.reading.ask(working_folder())

    def _read(self, file: Path) -> None:
        if not self.on_file(file):
            raise InputError(
                "holds no distances", file, "Choose a table that you saved with 'Export distances...'"
            )

    def on_file(self, path: Path) -> bool:
        """Add the distances of a table that was saved of this scan, but those that are there; whether the
        file is such a table."""
        if not is_distance_table(path):
            return False
        timeline = self.context.timeline
        work = partial(read_distances, path, timeline.name, self.context.unit, len(timeline), timeline.pose)
        self.context.run(f"Reading {path.name}", work, self._add)
        return True

    def _add(self, read: Mapping[str, Ends]) -> None:
        made = self.made
        known = {_positions([end.keys for end in made.owned_by(measure)]) for measure in made.distances}
        new = {name: ends for name, ends in read.items() if _positions(ends) not in known}
        for name, ends in new.items():
            made = made.with_distance(*ends, name)
        if new:
            self.context.change("Import distances", made)
            self.context.reveal()
        there = (
            f". The scan already has {len(read) - len(new)} of the distances in the file"
            if len(new) < len(read)
            else ""
        )
        self.context.note(f"Imported {len(new)} distances{there}.")


def _positions(ends: Sequence[Sequence[SurfacePoint]]) -> tuple[object, ...]:
    """The frames and positions of the ends, to a millionth of their distance: what tells it from others."""
    digits = 6 - math.floor(math.log10(math.dist(ends[0][0].position, ends[1][0].position) or 1))
    return tuple(
        (number, end.frame, *(round(x, digits) for x in end.position))
        for number, own in enumerate(ends)
        for end in own
    )


def _at_all(name: str, title: str, act: Callable[[Tool], None]) -> Command:
    """A command that does something with all distances."""
    return Command(f"{name}_distances", title, act, can=lambda tool: bool(tool.made.distances))


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
                Command("read_distances", "Import distances...", Tool.ask_to_read),
                _at_all("clear", "Clear", Tool.clear),
            ),
        )),
    )
}  # fmt: skip
MOUSE = (("Click while measuring", "Set an end point"),)
