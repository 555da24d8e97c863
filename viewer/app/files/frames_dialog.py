"""The dialog of folders: which files are frames, how they split into takes, their order, and their times."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ...errors import InputError
from ...files import printable
from ...scan.reading.corrections import Corrections
from ...scan.reading.frames import LIST
from ...scan.reading.record import KEYS, Decision
from ...scan.reading.takes import ALL, FileRow, split
from ...scan.sources import FileSequence
from ...scan.timeline import Timeline
from .. import widgets
from ..commands import Command
from ..playing.playback import Playback
from .reading_dialog import ReadingDialog

TITLE = "Choose frames"
CHOOSE_FRAMES = f"{TITLE}..."  # the command, and the buttons that do the same
AUTO = ""  # times as Scan4D finds them
RATE, FILE = "fps", "file"
TIMES = {
    AUTO: "automatic",
    "names": "from the file names",
    "index": "25 frames per second, without gaps",
    RATE: "another rate",
    FILE: "from a file",
}
_NARROW = 40.0  # width of the table, likewise, below which it has no column of takes
_FILE, _TAKE, _TIME, _WHY, _ORDER = "File", "Take", "Time", "Left aside", "Order"  # titles of columns


class FrameChoices:
    """Choices of the user about the files of a folder. No widgets.

    folder: that holds the files. take: the name of the take that opens, "all", or empty where there is one.
    rows: all files, in the order in which they play. used: names of the files that play. problem: why the
    choices are unusable; empty if usable.
    """

    KEYS = ("take", "frames", "times")

    def __init__(self, folder: Path, names: list[str], texts: Mapping[str, str]) -> None:
        """names: of the files of one kind, relative to the folder. texts: corrections that hold now."""
        self.folder, self._names = folder, names
        self._before = {key: text for key, text in texts.items() if key in self.KEYS}
        self._texts = dict(self._before)
        self.problem = ""
        whole = split(folder, names, Corrections.parse({"times": "index"}))  # so that it reads no times.csv
        self._takes = whole.takes
        self._take_of = {row.name: row.take for row in whole.files}
        self.rows: list[FileRow] = []
        self.used: set[str] = set()
        self._last: str | None = None  # the file that the user chose or left aside last
        self._found_times = ""  # those that Scan4D finds, in words
        self._look()
        listed = [name for name in self._texts.get("frames", "").split(LIST) if name]
        if LIST in self._texts.get("frames", ""):
            self.rows.sort(key=lambda row: listed.index(row.name) if row.name in listed else len(listed))

    def _look(self) -> None:
        """Find the rows anew. Choices that are unusable leave them as they are."""
        try:
            found = split(self.folder, self._names, Corrections.parse(self._texts))
        except InputError as error:
            self.problem = str(error)
            return
        self.problem = ""
        if "times" not in self._texts:
            self._found_times = _times_in_words(found.times)
        rows = {row.name: row._replace(take=self._take_of[row.name]) for row in found.files}
        if "frames" in self._texts and self.rows:
            rows = {row.name: rows[row.name] for row in self.rows}
        self.rows = list(rows.values())
        self.used = {row.name for row in self.rows if row.is_used}

    @property
    def takes(self) -> dict[str, str]:
        """Name -> title of each take, and of all together; empty where the files are of one."""
        if not self._takes:
            return {}
        named = {take.name: f"{take.name} ({take.frames})" for take in self._takes}
        return named | {ALL: "all, as one scan"}

    @property
    def take(self) -> str:
        """The take that is used; empty where the files are of one, or the user has chosen them one by one."""
        if not self._takes or "frames" in self._texts:
            return ""
        return self._texts.get("take") or self._takes[0].name

    @property
    def time_titles(self) -> dict[str, str]:
        """Kind -> title of each kind of times. The first one says what Scan4D finds, where that is known."""
        return {**TIMES, AUTO: ": ".join(filter(None, (TIMES[AUTO], self._found_times)))}

    @property
    def times(self) -> str:
        """The kind of times, one of `TIMES`."""
        text = self._texts.get("times", AUTO)
        if text in ("names", "index", AUTO):
            return text
        return RATE if text.startswith("fps:") else FILE

    @property
    def rate(self) -> float:
        """The stated rate, frame numbers a second; 25 without one."""
        text = self._texts.get("times", "")
        return float(text.removeprefix("fps:")) if self.times == RATE else 25.0

    @property
    def times_file(self) -> str:
        """The stated file of times."""
        return self._texts.get("times", "") if self.times == FILE else "times.csv"

    def state_take(self, take: str) -> None:
        """Use the files of a take, in their natural order."""
        self._texts.pop("frames", None)
        self._state("take", take)

    def state_times(self, text: str) -> None:
        """Correct the times, as `--read times` takes them; empty: as Scan4D finds them."""
        self._state("times", text)

    def use(self, name: str, is_used: bool, *, reaches: bool = False) -> None:
        """Use a file as a frame, or leave it aside. reaches: also all files from the one that was chosen or
        left aside last."""
        names = [row.name for row in self.rows]
        first = names.index(self._last) if reaches and self._last in names else names.index(name)
        low, high = sorted((first, names.index(name)))
        several = {*names[low : high + 1]}
        self._last = name
        self.used = self.used | several if is_used else self.used - several
        self._list()

    def use_all(self, is_used: bool) -> None:
        """Use all files as frames, or leave all aside."""
        self.used = {row.name for row in self.rows} if is_used else set()
        self._list()

    def can_move(self, at: int, by: int) -> bool:
        """Whether the frame of a row can play one earlier (-1) or later (1)."""
        return self.rows[at].name in self.used and self._neighbour(at, by) is not None

    def move(self, at: int, by: int) -> None:
        """Have the frame of a row play one earlier (-1) or later (1)."""
        to = self._neighbour(at, by)
        if to is not None and self.can_move(at, by):
            self.rows.insert(to, self.rows.pop(at))
            self._list()

    def _neighbour(self, at: int, by: int) -> int | None:
        """The row of the next frame before (-1) or after (1) a row."""
        after = range(at + by, len(self.rows) if by > 0 else -1, by)
        return next((row for row in after if self.rows[row].name in self.used), None)

    def _list(self) -> None:
        names = [row.name for row in self.rows if row.name in self.used]
        self._texts.pop("take", None)
        if names:
            self._state("frames", LIST.join(names) + LIST)
        else:
            self.problem = "Choose at least one file"

    @property
    def can_open(self) -> bool:
        """Whether Scan4D can read the folder with these choices."""
        return not self.problem

    def reset(self) -> None:
        """Leave all decisions to Scan4D."""
        self._texts = {}
        self._look()

    @property
    def summary(self) -> str:
        """A sentence on the number of frames and their times, and one on what the user changes."""
        times = [row.time for row in self.rows if row.time is not None]
        ends = f", from {min(times):.6g} to {max(times):.6g} s" if len(times) > 1 else ""
        changed = [key for key in self.KEYS if self._texts.get(key) != self._before.get(key)]
        changes = ", ".join(KEYS[key].lower() for key in changed)
        return (
            f"{len(self.used)} of {len(self.rows)} files are frames of the scan{ends}. "
            + (f"You change: {changes}." if changes else "No changes.")
        )  # fmt: skip

    def _state(self, key: str, text: str) -> None:
        self._texts.pop(key, None)
        if text:
            self._texts[key] = text
        self._look()

    @property
    def corrections(self) -> dict[str, str]:
        """Corrections by key; an empty text ends a correction that held before."""
        return {**dict.fromkeys(self._before, ""), **self._texts}


def _times_in_words(times: Decision) -> str:
    """Times that Scan4D finds, and where: "25 frames per second, assumed"."""
    if times.value is None:
        return ""
    if times.source == "neighbour" or times.value in ("names", "stored"):
        return times.shown_source
    return f"{times.shown}, {times.shown_source}"


def files_of_scan(timeline: Timeline) -> tuple[Path, list[str]] | None:
    """The folder of a sequence of files, and the names of all files of its kind, also those left aside; None
    where the scan is no such sequence."""
    if not isinstance(timeline.source, FileSequence) or not timeline.files:
        return None
    frames = [file for file in timeline.files if file.suffix.lower() == timeline.files[0].suffix.lower()]
    folder, suffix = frames[0].parent, frames[0].suffix.lower()
    if any(file.parent != folder for file in frames):
        return None
    aside = [one.file for one in timeline.reading.aside if Path(one.file).suffix.lower() == suffix]
    names = list(dict.fromkeys([*(file.name for file in frames), *aside]))
    return (folder, names) if len(names) > 1 else None


@dataclass(eq=False)
class FramesDialog(ReadingDialog):
    """The dialog. choices: about the folder that it shows, None while it is closed."""

    name = "frames_dialog"
    title = TITLE
    shows = "The dialog of folders"
    OFFERS = {"ask_for_frames": "ask"}
    CONDITIONS = {"sequence of files": lambda dialog: dialog.files is not None}
    playback: Playback
    correct_reading: Callable[..., None]

    def __post_init__(self) -> None:
        self.choices: FrameChoices | None = None
        self._of: Timeline | None = None  # that these are the files of
        self._files: tuple[Path, list[str]] | None = None

    @property
    def files(self) -> tuple[Path, list[str]] | None:
        """The folder and the names of the open scan's files; None where it is no sequence of files."""
        if self._of is not self.playback.timeline:
            self._of = self.playback.timeline
            self._files = files_of_scan(self._of)
        return self._files

    def ask(self) -> None:
        """Open the dialog on the files of the open scan."""
        if self.files is not None:
            self.show(FrameChoices(*self.files, self.playback.timeline.decided.corrections.texts))

    def draw_choices(self, choices: FrameChoices, foot: float) -> None:
        """Declare the take, the times, and the files."""
        imgui.text_wrapped(printable(str(choices.folder)))
        if choices.takes:
            _draw_take(choices)
        _draw_times(choices)
        _draw_files(choices, -foot)

    def open_scan(self, choices: FrameChoices) -> None:
        """Open the scan with the frames and the times that the user chose."""
        self.correct_reading(choices.corrections)

    COMMANDS = (Command("read_folder", CHOOSE_FRAMES, ask, when="sequence of files"),)


def _draw_take(choices: FrameChoices) -> None:
    """Declare the take."""
    widgets.dialog_label("Take", "The folder holds several scans, and each scan has its own frame numbers")
    titles = {"": "chosen files", **{name: printable(title) for name, title in choices.takes.items()}}
    take = widgets.combo("take", choices.take, list(choices.takes), titles)
    if take != choices.take:
        choices.state_take(take)


def _draw_times(choices: FrameChoices) -> None:
    """Declare the kind of times, and the field that goes with it."""
    widgets.dialog_label("Times", "When each frame happens")
    titles = {kind: printable(title) for kind, title in choices.time_titles.items()}
    kind = widgets.combo("times", choices.times, list(TIMES), titles)
    if kind != choices.times:
        texts = {RATE: f"fps:{choices.rate:g}", FILE: choices.times_file}
        choices.state_times(texts.get(kind, kind))
    if choices.times == RATE:
        widgets.dialog_label("Frames per second")
        changed, rate = imgui.input_float("##rate", choices.rate, 1.0, 10.0, "%.6g")
        if changed and rate > 0:
            choices.state_times(f"fps:{rate:.6g}")
    elif choices.times == FILE:
        widgets.dialog_label(
            "File of times",
            "Table of times in this folder. Each row gives a file name or an index, and its time in seconds",
        )
        entered, name = widgets.edit_path("##file", choices.times_file)
        if entered and name.strip():
            choices.state_times(name)


def _draw_files(choices: FrameChoices, height: float) -> None:
    """Declare all files. height: negative, from the foot."""
    flags = imgui.TableFlags_.scroll_y | imgui.TableFlags_.borders_outer | imgui.TableFlags_.borders_inner_h
    flags |= imgui.TableFlags_.resizable
    columns = _columns(choices)
    widgets.join_next_to_tabs()
    if not imgui.begin_table("files", len(columns), flags, ImVec2(0, height)):
        return
    em = imgui.get_font_size()
    for title, width in columns.items():
        kind = imgui.TableColumnFlags_.width_fixed if width else imgui.TableColumnFlags_.width_stretch
        imgui.table_setup_column(title, kind, width * em)
    imgui.table_setup_scroll_freeze(0, 1)
    imgui.table_next_row(imgui.TableRowFlags_.headers)
    imgui.table_next_column()
    toggled, is_used = imgui.checkbox(f"{_FILE}###all", len(choices.used) == len(choices.rows))
    widgets.tooltip(
        "Choose all files, or none. To choose several files, click the first, then Shift+click the last."
    )
    if toggled:
        choices.use_all(is_used)
    for title in [*columns][1:]:
        imgui.table_next_column()
        imgui.align_text_to_frame_padding()
        imgui.text_unformatted(title)
    clipper = imgui.ListClipper()
    clipper.begin(len(choices.rows))
    while clipper.step():
        for at in range(clipper.display_start, clipper.display_end):
            imgui.push_id(widgets.unhidden(choices.rows[at].name))
            _draw_file(choices, at, columns)
            imgui.pop_id()
    imgui.end_table()


def _columns(choices: FrameChoices) -> dict[str, float]:
    """Title -> width of each column, in heights of the font; 0: what is left."""
    is_wide = imgui.get_content_region_avail().x > _NARROW * imgui.get_font_size()
    takes = {_TAKE: 8.0} if choices.takes and is_wide else {}
    why = {_WHY: 0.0} if len(choices.used) < len(choices.rows) else {}
    return {_FILE: 0.0, **takes, _TIME: 6.0, **why, _ORDER: 4.5}


def _draw_file(choices: FrameChoices, at: int, columns: Collection[str]) -> None:
    """Declare the row of one file."""
    row = choices.rows[at]
    is_used = row.name in choices.used
    imgui.table_next_row()
    imgui.table_next_column()
    toggled, wanted = imgui.checkbox(widgets.labelled(printable(row.name), row.name), is_used)
    widgets.tooltip(printable(row.name if is_used else f"{row.name}\nLeft aside: {row.why}"))
    if toggled:
        choices.use(row.name, wanted, reaches=imgui.get_io().key_shift)
    if _TAKE in columns:
        imgui.table_next_column()
        imgui.text_unformatted(printable(row.take))
    imgui.table_next_column()
    imgui.text_unformatted("" if row.time is None or not is_used else f"{row.time:.6g} s")
    if _WHY in columns:
        imgui.table_next_column()
        imgui.text_disabled("" if is_used else printable(row.why))
    imgui.table_next_column()
    for by, icon, help in ((-1, icons.ICON_FA_ARROW_UP, "Earlier"), (1, icons.ICON_FA_ARROW_DOWN, "Later")):
        imgui.begin_disabled(not choices.can_move(at, by))
        if widgets.flat_button(icon, help):
            choices.move(at, by)
        imgui.end_disabled()
        imgui.same_line()
    imgui.new_line()
