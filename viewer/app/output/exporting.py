"""Exporting from the window: what the user chose, and the work, which a process of its own does."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import wait as wait_for
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from imgui_bundle import icons_fontawesome_6 as icons

from ...document.recording import Entry, Recording
from ...document.render_job import Made, make
from ...document.schema import plain
from ...errors import InputError
from ...files import working_folder
from ...output.legend import Marks
from ...output.overlays import NOTHING_DRAWN, DrawnMarks
from ...scan.inputs import found_among, scan_inputs
from ...task import Cancelled, Task, in_background
from ..commands import Command
from ..file_dialog import FOLDER, FileDialog
from ..notices import Offer, Problem
from ..part import WindowPart, remembered
from ..playing.playback import Playback
from ..scene.viewport import Viewport
from ..session import Session
from . import export_plan
from .export_plan import Choices, free_name

log = logging.getLogger(__name__)
_CANCELLING = 10.0  # seconds that closing waits for a cancelled process to be gone
_MOST_WARNINGS = 3  # that are shown


@dataclass(eq=False)
class Exporting(WindowPart):
    """The dialog's state, and one export at a time.

    shown_entry: brings what the picture shows, with these marks. redraw: has the window drawn again. drawn:
    brings what tools draw over a frame. is_open: whether the dialog is. replaced: files that an export would
    replace, which the dialog asks about. own: those of them that are the scan's. is_leaving: whether to ask
    before the window closes. task: the export that runs, None without one.
    """

    name = "exporting"
    doing = "Exporting"
    OFFERS = {"make_film": "film"}
    session: Session
    playback: Playback
    viewport: Viewport
    note_of_work: Callable[[str], None]
    shown_entry: Callable[[Marks], Entry | None]
    redraw: Callable[[], None]
    drawn: Callable[[int], DrawnMarks] = lambda _: NOTHING_DRAWN
    choices: Choices = remembered(factory=Choices)
    marks: Marks = remembered(
        factory=lambda: Marks(plot=True)
    )  # over the pictures; the plot where it is shown

    def __post_init__(self) -> None:
        self.is_open = False
        about = "Scan4D saves the exported files in this folder"
        self.choosing: FileDialog = FileDialog(
            FOLDER, "Choose a folder", about, (), self._choose_folder, self.redraw
        )
        self.replaced: list[Path] = []
        self.own: list[Path] = []
        self.is_leaving = False
        self.task: Task | None = None
        self._work: Future[Made] | None = None
        self._suggested = ""
        self._span: tuple[str, tuple[int, int] | None] | None = None  # of a scan, that was suggested

    def choose_folder(self) -> None:
        """Open the dialog that asks where the files go."""
        known = Path(os.path.expanduser(self.choices.folder.strip()))
        self.choosing.ask(known if known.is_dir() else working_folder())

    def _choose_folder(self, folder: Path) -> None:
        self.change(replace(self.choices, folder=str(folder)), self.marks)

    @property
    def can(self) -> bool:
        """Whether there is something to export, and nothing is being exported."""
        return self.viewport.is_there and self.task is None

    def remembered(self) -> dict[str, Any]:
        """The values that come back at the next start; frames and name are those of one scan."""
        choices = replace(self.choices, first=1, last=None, name="")
        return super().remembered() | {"choices": plain(choices)}

    @property
    def count(self) -> int:
        """Frames of the scan."""
        return len(self.playback.timeline)

    @property
    def even_rate(self) -> float:
        """Pictures a second of an even film, as chosen or suggested."""
        return self.choices.even_rate(self.playback.timeline.times)

    @property
    def size(self) -> tuple[int, int] | None:
        """Width and height of the picture in the window, pixels; None where there is none."""
        return self.viewport.size if self.viewport.surface else None

    @property
    def quality(self) -> str:
        """The quality of the view's look."""
        return self.session.document.look.quality

    def ask(self) -> None:
        """Open the dialog; a name is suggested unless the user gave one."""
        if self._entry() is None:
            return
        choices = self.choices
        if (span := (self.session.scan, self.session.document.span)) != self._span:
            self._span = span
            first, last = span[1] or (0, None)
            choices = replace(choices, first=first + 1, last=None if last is None else last + 1)
        if not choices.folder or "folder" in self.problems():
            choices = replace(choices, folder=str(working_folder()))
        if choices.name in ("", self._suggested):
            self._suggested = free_name(choices.out().parent)
            choices = replace(choices, name=self._suggested)
        self.change(choices, self.marks)
        self.is_open = True
        log.debug("export dialog opens")

    def change(self, choices: Choices, marks: Marks) -> None:
        """Take in what the user has edited."""
        if (choices, marks) != (self.choices, self.marks):
            self.choices, self.marks, self.replaced, self.own = choices, marks, [], []

    def problems(self) -> dict[str, str]:
        """Find what is wrong with the choices, by field."""
        most_pixels = self.viewport.renderer.gpu.max_pixels
        return export_plan.problems(self.choices, self.playback.timeline.times, most_pixels)

    def start(self) -> None:
        """Export, unless that would replace files that the user was not asked about; closes the dialog.

        Frames are not exported by numbers that are laid over some, also where the one that is shown has none.
        """
        name = self.session.document.look.color_by
        computed = self.session.laid.names.difference(self.drawn(self.session.index).replayable)
        if self.choices.what == export_plan.FRAMES and name in computed:
            self.note_of_work(
                f"Cannot export: some frames use the colours '{name}', which a tool computes. Choose "
                "other colours."
            )
            return
        there = export_plan.present(self.choices, self.count)
        shown, choices, timeline = self._entry(), self.choices, self.playback.timeline
        self.own = found_among(there, scan_inputs(timeline))
        if self.own or there != self.replaced or shown is None:
            self.replaced = [] if self.own else there
            return
        self.is_open, self.replaced = False, []
        pivot, motion_of = self.session.document.pivot, self.session.laid.world_from_pose
        recording = export_plan.recording(
            choices, shown, self.marks, timeline.times, pivot, motion_of, self.drawn
        )
        fps, numbers = choices.fps, choices.numbers(self.count)
        self._begin(choices.name, recording, choices.out(), fps, choices.anonymous, numbers, replaced=there)

    def film(self, recording: Recording, out: Path) -> None:
        """Make a film of a recording, of the size that the view had. out: under another name where that is
        taken."""
        if self.task is None:
            self._begin(out.name, recording, out, None, False)
        else:
            again = {"Save as film": lambda: self.film(recording, out)}
            self.note_of_work(Offer("An export is running. Wait for it, or cancel it.", again, "recording"))

    def _begin(self, name: str, recording: Recording, out: Path, *how: Any, **more: Any) -> None:
        """Have a process make pictures or a film. how, more: as `make` takes them."""
        task = self.task = Task(f"Exporting {name}")
        self._work = in_background(task, lambda: make(task, recording, out, *how, **more))
        log.debug("exporting %s", out)

    def _entry(self) -> Entry | None:
        """The entry of what the picture shows; where that cannot be drawn again, a message says why."""
        try:
            shown = self.shown_entry(self.marks)
            return shown and replace(shown, automatic=None)  # it was expected of this size and view
        except InputError as error:
            self.note_of_work(Problem(f"Cannot export: {error}"))
        return None

    def advance(self, now: float) -> None:
        """Tell what came of an export that has ended."""
        if self._work is None or not self._work.done():
            return
        work, self._work, self.task = self._work, None, None
        try:
            self._tell(work.result())
        except Cancelled:
            log.debug("the export is gone")
        except Exception as error:  # whatever the process meets, the window stays
            log.debug("cannot export", exc_info=error)
            self.note_of_work(Problem(f"Cannot export: {error}"))

    def _tell(self, made: Made) -> None:
        first, last = made.files[0], made.files[-1]
        several = f"{len(made.files)} pictures, {first} to {last.name}"
        self.note_of_work(f"Saved {first if len(made.files) == 1 else several}")
        for warning in made.warnings[:_MOST_WARNINGS]:
            self.note_of_work(warning)
        if made.device != self.viewport.renderer.gpu.device:
            self.note_of_work(
                f"{made.device} drew the exported pictures, not the window's GPU. The pictures may "
                "differ slightly from the window."
            )

    def asks_to_stay(self) -> bool:
        """Whether an export runs that the user has to be asked about before the window closes."""
        self.is_leaving = self.task is not None and not self.task.cancelled
        if self.is_leaving:
            log.debug("asks before it closes")
        return self.is_leaving

    def finish(self) -> None:
        """Cancel what runs, and wait until it is gone."""
        if self.task is not None and self._work is not None:
            self.task.cancel()
            wait_for([self._work], _CANCELLING)

    COMMANDS = (
        Command(
            "export", "Export...", ask, "Ctrl+E", can=lambda exporting: exporting.can, short="Export",
            icon=icons.ICON_FA_FILM,
        ),
    )  # fmt: skip
