"""Files of landmarks and templates: read and saved by dialogs, or dropped."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ....analysis.landmarks import Landmark, Template
from ....analysis.landmarks.files import (
    holds_one_moment,
    is_landmark_file,
    landmark_suffixes,
    read_landmarks,
    write_landmarks,
)
from ....analysis.landmarks.landmark_set import LandmarkSet, why_apart
from ....analysis.landmarks.placed import landmarks_of, why_beside
from ....analysis.landmarks.templates import (
    is_template_file,
    read_template,
    save_template,
    template_of,
    templates,
)
from ....analysis.measures.distances import is_distance_table
from ....analysis.track import Track
from ....bounds import Bounds
from ....document.landmarks import Landmarks
from ....errors import InputError
from ....files import working_folder
from ....scan.inputs import refuse_input
from ....scan.reading.axes import landmark_space
from ....scan.timeline import Timeline
from ....scan.times import frame_in_words
from ...file_dialog import OPEN, SAVE, FileDialog
from ...tool_context import ToolContext

_USUAL = ".mrk.json"
_SAMPLED = 8  # frames whose bounds stand for those of all


class Exchange:
    """Reads and saves landmarks of the open scan. templates: by name; those that were read too."""

    def __init__(self, context: ToolContext, begin: Callable[[Template], None]) -> None:
        """begin: has the landmarks of a template placed."""
        self._context, self._begin = context, begin
        self.templates: dict[str, Template] = dict(templates())
        written = [suffix for suffix in landmark_suffixes(written=True) if suffix != _USUAL]
        redraw = context.redraw
        self._saving = FileDialog(
            SAVE, "Export landmarks",
            f"The suffix of the file name sets the format: {_USUAL}, {', '.join(written)}",
            (_USUAL, *written), self._save, redraw,
        )  # fmt: skip
        self._reading = FileDialog(
            OPEN, "Import landmarks", "A file of landmarks, or a template",
            (".json", *landmark_suffixes()), self._read, redraw,
        )  # fmt: skip
        about = (
            "A template stores the names, mirror partners and measures of landmarks, for use in other scans"
        )
        self._template_saving = FileDialog(
            SAVE, "Save template", about, (".json",), self._save_template, redraw
        )
        about = "A file that you saved with 'Save as template...'"
        self._template_reading = FileDialog(
            OPEN, "Choose template", about, (".json",), self._read_template, redraw
        )
        self._doubted: Path | None = None  # file whose landmarks seem to be of another scan

    def draw(self) -> None:
        """Declare the dialogs that name a file, while one is open."""
        for dialog in (self._saving, self._reading, self._template_saving, self._template_reading):
            dialog.draw()

    def ask_to_save(self) -> None:
        """Open the dialog that saves, with a name that is free."""
        self._saving.ask(self._context.free_file(f"_landmarks{_USUAL}"))

    def ask_to_read(self) -> None:
        """Open the dialog that reads landmarks or a template."""
        self._reading.ask(working_folder())

    def ask_to_save_template(self) -> None:
        """Open the dialog that saves the present landmarks as a template."""
        self._template_saving.ask(working_folder() / "template.json")

    def ask_for_template(self) -> None:
        """Open the dialog that chooses the file of a template."""
        self._template_reading.ask(working_folder())

    def take(self, path: Path) -> bool:
        """Read a file that was opened or dropped; whether it holds landmarks or a template."""
        if is_distance_table(path):  # its ends, x_1 and x_2, would pass for two landmarks
            return False
        if is_landmark_file(path):
            self._read_landmarks(path)
        elif is_template_file(path):
            self._read_template(path)
        else:
            return False
        return True

    def _read(self, file: Path) -> None:
        if not self.take(file):
            raise InputError("holds no landmarks", file, f"Known: {', '.join(landmark_suffixes())}")

    def _read_template(self, path: Path) -> None:
        template = read_template(path)
        self.templates[template.name] = template
        self._begin(template)

    def _save_template(self, file: Path) -> None:
        refuse_input(file, self._context.timeline)
        made = self._context.document.part(Landmarks)
        template = template_of(file.name.removesuffix(".json"), made.listed, made.measures)
        save_template(file, template)
        self.templates[template.name] = template
        counts = f"{len(template.landmarks)} landmarks and {len(template.measures)} measures"
        self._context.note(f"Saved {file}, {counts}.")

    def _read_landmarks(self, path: Path) -> None:
        """Have a file read beside the window. One that seems to be of another scan is taken at the second
        time."""
        timeline, context = self._context.timeline, self._context
        frame = context.index if context.pose is None else context.pose.index
        unit, known, is_sure = context.unit, context.document.part(Landmarks).all, path == self._doubted
        self._doubted = path

        def read() -> tuple[LandmarkSet, tuple[Landmark, ...]]:
            found = read_landmarks(path, unit, landmark_space(timeline.reading["axes"]))
            problem = None if is_sure else why_apart(found, _bounds(found, timeline, frame))
            if problem is not None:
                raise InputError(problem, path, "Import the file again to use these landmarks anyway")
            return found, landmarks_of(found, timeline.visit, len(timeline), frame, known)

        def take(result: tuple[LandmarkSet, tuple[Landmark, ...]]) -> None:
            found, landmarks = result
            self._doubted = None
            if self._context.timeline is timeline:
                self._add(path, found, landmarks)

        context.run(f"Reading {path.name}", read, take)

    def _add(self, path: Path, found: LandmarkSet, landmarks: tuple[Landmark, ...]) -> None:
        self._context.change("Import landmarks", self._context.document.part(Landmarks).with_read(landmarks))
        self._context.reveal()
        for text in found.remarks:
            self._context.note(f"{path.name}: {text}.")
        if beside := why_beside(landmarks):
            self._context.note(f"{path.name}: {beside}")
        self._context.note(f"Imported {len(landmarks)} landmarks from {path.name}.")

    def _save(self, file: Path) -> None:
        timeline, context = self._context.timeline, self._context
        refuse_input(file, timeline)
        landmarks, tracks = context.document.part(Landmarks).listed, context.followed.tracks
        frame, unit = context.index if context.pose is None else context.pose.index, context.unit
        is_one, is_whole = holds_one_moment(file), all(track.is_whole for track in tracks.values())

        def save() -> str | None:
            pending = Track.pending(timeline.times)
            all_tracks = {one.name: tracks.get(one.name, pending) for one in landmarks}
            found = LandmarkSet.of_tracks(all_tracks, unit, {one.name: one.about for one in landmarks})
            axes = landmark_space(timeline.reading["axes"])
            return write_landmarks(file, found.at(frame) if is_one else found, axes)

        def tell(remark: str | None) -> None:
            frames = frame_in_words(frame) if is_one else f"{len(timeline)} frames"
            gaps = "" if is_one or is_whole else "; frames that are not tracked yet have no data in the file"
            context.note(f"Saved {file}, {frames}{gaps}." + (f" {remark}" if remark else ""))

        context.run(f"Saving {file.name}", save, tell)


def _bounds(found: LandmarkSet, timeline: Timeline, frame: int) -> Bounds:
    """The bounds of the frames that landmarks are of, or of some of many."""
    frames = (
        [index for index in found.frames.tolist() if 0 <= index < len(timeline)] if found.is_framed else []
    )
    frames = (frames or [frame])[:: max(1, len(frames) // _SAMPLED)]
    return Bounds.around([timeline.visit(index).bounds for index in frames])
