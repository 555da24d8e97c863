"""The dialog of text tables: the first lines, the role of each column, and how the numbers are written."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from imgui_bundle import ImVec2, imgui

from ...errors import InputError
from ...files import printable
from ...scan.formats.text import SUFFIXES
from ...scan.reading.corrections import ROLES, Corrections
from ...scan.reading.record import KEYS
from ...scan.reading.tables import UNREAD, TablePreview, preview, split_names
from ...task import Task, in_background
from .. import widgets
from ..commands import Command
from ..playing.playback import Playback
from .reading_dialog import ReadingDialog

TITLE = "Read table"
READ_TABLE = f"{TITLE}..."  # the command, and the buttons that do the same
AUTO = "auto"  # choice that leaves a decision to Scan4D
ENCODINGS = {"utf-8": "UTF-8", "utf-16": "UTF-16", "latin-1": "Latin-1 (Western European)"}
SEPARATORS = {
    "blank": "blanks", "tab": "tabs", "comma": "commas", "semicolon": "semicolons", "bar": "bars",
}  # fmt: skip
DECIMALS = {".": "point (1.5)", ",": "comma (1,5)"}
ROLE_TITLES = {
    "-": "not read",
    "nx": "normal x",
    "ny": "normal y",
    "nz": "normal z",
    "r": "red",
    "g": "green",
    "b": "blue",
    "a": "alpha",
    "number": "point number",
    "row": "grid row",
    "column": "grid column",
    "frame": "frame",
    "time": "time",
    "id": "point id",
}
AXES = ("x", "y", "z")
_MOST_SKIPPED = 1 << 16  # lines
_MOST_COLUMNS = 60  # that the dialog shows
_COLUMN = 8.0  # width, in heights of the font
_LINES_ABOVE = 4  # that are shown at once


def is_table(scan: str | Path) -> bool:
    """Whether a file is a text table, by its name."""
    return Path(scan).suffix.lower() in SUFFIXES


class TableChoices:
    """Choices of the user about one table. No widgets.

    path: of the table. texts: corrections as `--read` takes them, only those that the user made. shown: what
    the table is with these; None until it was read. problem: why the choices are unusable; empty if usable.
    """

    KEYS = ("columns", "separator", "decimal", "encoding", "skip")

    def __init__(self, path: Path, texts: Mapping[str, str]) -> None:
        """texts: corrections that hold now, also those of other keys, such as the unit."""
        self.path = path
        self._others = {key: text for key, text in texts.items() if key not in self.KEYS}
        self._before = {key: text for key, text in texts.items() if key in self.KEYS}
        self.texts = dict(self._before)
        self.shown: TablePreview | None = None
        self.problem = ""
        self._reading: Future[TablePreview] | None = None
        self._look()

    def state(self, key: str, text: str) -> None:
        """Correct one key; an empty text leaves the decision to Scan4D. Roles of columns go with a change of
        the separator or the decimal mark, as the columns then are others."""
        self.texts.pop(key, None)
        if text:
            self.texts[key] = text
        if key in ("separator", "decimal"):
            self.texts.pop("columns", None)
        self._look()

    def state_role(self, column: int, role: str) -> None:
        """Give a column a role. A column that has this role so far is no longer read."""
        roles = [("-" if had == role and role != "-" else had) for had in self.roles]
        roles[column] = role
        self.state("columns", " ".join(roles))

    def reset(self) -> None:
        """Leave all decisions to Scan4D."""
        self.texts = {}
        self._look()

    @property
    def roles(self) -> list[str]:
        """A role for each column: those that the user gave, else those that Scan4D finds."""
        width = 0 if self.shown is None else max(map(len, self.shown.cells), default=0)
        stated = self.texts.get("columns", "").replace(",", " ").split()
        found = stated or list(self.shown.roles if self.shown else ())
        return [*found, *["-"] * width][:width]

    @property
    def names(self) -> list[str]:
        """Names of the columns in the last line above the rows; empty where their number differs."""
        if self.shown is None or not self.shown.cells or not 0 < self.shown.skip <= len(self.shown.lines):
            return []
        words = split_names(self.shown.lines[self.shown.skip - 1])
        return words if len(words) == len(self.shown.cells[0]) > 1 else []

    @property
    def summary(self) -> str:
        """A sentence on the columns that Scan4D reads, and one on what the user changes."""
        read = [ROLE_TITLES.get(role, role) for role in self.roles if role not in UNREAD]
        changed = [key for key in self.KEYS if self.texts.get(key) != self._before.get(key)]
        changes = ", ".join(KEYS[key].lower() for key in changed)
        return f"Scan4D reads {', '.join(read)}. " + (f"You change: {changes}." if changes else "No changes.")

    @property
    def can_open(self) -> bool:
        """Whether Scan4D can read the table with these choices."""
        return self.shown is not None and not self.problem and not self.waits

    @property
    def corrections(self) -> dict[str, str]:
        """Corrections by key; an empty text ends a correction that held before."""
        return {**dict.fromkeys(self._before, ""), **self.texts}

    @property
    def waits(self) -> bool:
        """Whether the table is being read."""
        return self._reading is not None

    def _look(self) -> None:
        """Read the table with those texts that are usable: roles may not be whole yet."""
        usable: dict[str, str] = {}
        self.problem = ""
        for key, text in {**self._others, **self.texts}.items():
            try:
                usable |= Corrections.parse({key: text}).texts
            except InputError as error:
                self.problem = "" if key == "columns" else str(error)
        corrections = Corrections.parse(usable)
        self._reading = in_background(Task("Reading"), partial(preview, self.path, corrections))

    def advance(self) -> bool:
        """Take in what was read; whether there is anything new."""
        if self._reading is None or not self._reading.done():
            return False
        reading, self._reading = self._reading, None
        try:
            self.shown = reading.result()
        except InputError as error:
            self.shown, self.problem = None, str(error)
        else:
            self.problem = self.problem or self._why_not(self.shown)
        return True

    def _why_not(self, shown: TablePreview) -> str:
        """Why Scan4D cannot read the table so, and what the user can do; empty where it can."""
        reason = f"{shown.problem[:1].upper()}{shown.problem[1:]}. " if shown.problem else ""
        lacking = [axis for axis in AXES if axis not in self.roles]
        has_columns = max(map(len, shown.cells), default=0) >= len(AXES)
        if lacking and has_columns:
            given = "columns" in self.texts
            what = f"Choose a column for {_listed(lacking)}."
            return what if given else reason + what
        return reason.strip()


def _listed(words: Sequence[str]) -> str:
    """Words in a sentence: "x, y and z"."""
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


@dataclass(eq=False)
class TableDialog(ReadingDialog):
    """The dialog. choices: about the table that it shows, None while it is closed."""

    name = "table_dialog"
    doing = "Reading a table"
    title = TITLE
    shows = "The dialog of tables"
    OFFERS = {"ask_for_table": "ask"}
    CONDITIONS = {"text table": lambda dialog: dialog.table is not None}
    playback: Playback
    correct_reading: Callable[..., None]

    def __post_init__(self) -> None:
        self.choices: TableChoices | None = None
        self._scan: str | None = None  # to open; None: the open one

    @property
    def table(self) -> Path | None:
        """The text table that the open scan is read from, the shown frame's; None where it is no table."""
        files = self.playback.timeline.files
        if not files or not is_table(files[0]):
            return None
        index = self.playback.pose.index if self.playback.pose is not None else 0
        return files[min(index, len(files) - 1)]

    def ask(self, scan: str | None = None) -> None:
        """Open the dialog on the table of the open scan, or on another scan, a file that could not be
        opened."""
        path = self.table if scan is None else Path(scan)
        if path is not None:
            held = self.playback.timeline.decided.corrections.texts if scan is None else {}
            self._scan = scan
            self.show(TableChoices(path, held))

    @property
    def waits(self) -> bool:
        """Whether the table is being read."""
        return self.choices is not None and self.choices.waits

    def advance(self, now: float) -> bool:
        """Take in what was read."""
        return self.choices is not None and self.choices.advance()

    def draw_choices(self, choices: TableChoices, foot: float) -> None:
        """Declare the choices about all lines, and the rows with a role for each column."""
        imgui.text_wrapped(printable(choices.path.name))
        if choices.shown is not None:
            _draw_table(choices, choices.shown, foot)

    def open_scan(self, choices: TableChoices) -> None:
        """Open the table with the choices."""
        self.correct_reading(choices.corrections, self._scan)

    COMMANDS = (Command("read_table", READ_TABLE, ask, when="text table"),)


def _draw_table(choices: TableChoices, shown: TablePreview, foot: float) -> None:
    """Declare the choices and the rows of a table. foot: height of what stands below, pixels."""
    _draw_word(choices, "separator", "Separator", SEPARATORS, shown.separator)
    _draw_word(choices, "decimal", "Decimal mark", DECIMALS, shown.decimal)
    _draw_word(choices, "encoding", "Encoding", ENCODINGS, shown.encoding)
    widgets.dialog_label("Lines to skip", "Number of lines above the first row of values; Scan4D skips them")
    changed, lines = imgui.input_int("##skip", shown.skip, 1, 10)
    if changed:
        choices.state("skip", str(min(max(lines, 0), _MOST_SKIPPED)))
    names = choices.names
    _draw_above(shown.lines[: shown.skip - bool(names)])
    _draw_rows(choices, names, shown.cells, -foot)


def _draw_word(choices: TableChoices, key: str, title: str, words: Mapping[str, str], found: str) -> None:
    """Declare a combo of one key. found: what Scan4D reads now."""
    widgets.dialog_label(title)
    stated = choices.texts.get(key, AUTO)
    titles = {**words, AUTO: "automatic" if key in choices.texts else f"automatic: {words.get(found, found)}"}
    chosen = widgets.combo(key, stated, [AUTO, *words], titles)
    if chosen != stated:
        choices.state(key, "" if chosen == AUTO else chosen)


def _draw_above(lines: Sequence[str]) -> None:
    """Declare the lines above the first row."""
    if lines:
        height = min(len(lines), _LINES_ABOVE) * imgui.get_text_line_height_with_spacing()
        imgui.begin_child(
            "above", ImVec2(0, height + 2 * imgui.get_style().window_padding.y), imgui.ChildFlags_.borders
        )
        for line in lines:
            imgui.text_disabled(printable(line.replace("\t", "    ")))
        imgui.end_child()


def _draw_rows(
    choices: TableChoices, names: Sequence[str], cells: Sequence[Sequence[str]], height: float
) -> None:
    """Declare the first rows, below a role for each column. names: of the columns in the file, or none.
    height: of the table, negative: from the foot."""
    width = min(max(map(len, cells), default=0), _MOST_COLUMNS)
    flags = imgui.TableFlags_.borders | imgui.TableFlags_.row_bg | imgui.TableFlags_.scroll_x
    flags |= imgui.TableFlags_.scroll_y | imgui.TableFlags_.sizing_fixed_fit
    widgets.join_next_to_tabs()
    if not width or not imgui.begin_table("rows", width, flags, ImVec2(0, height)):
        return
    column_width = _COLUMN * imgui.get_font_size()
    for column in range(width):
        imgui.table_setup_column(f"##{column}", imgui.TableColumnFlags_.width_fixed, column_width)
    imgui.table_setup_scroll_freeze(0, 2 if names else 1)
    imgui.table_next_row()
    roles = choices.roles
    for column in range(width):
        imgui.table_set_column_index(column)
        imgui.set_next_item_width(-1)
        words = list(ROLES) if roles[column] in ROLES else [roles[column], *ROLES]
        role = widgets.combo(f"role {column}", roles[column], words, ROLE_TITLES)
        if role != roles[column]:
            choices.state_role(column, role)
    _draw_row([printable(name) for name in names[:width]], ["-"] * width)
    for row in cells:
        _draw_row(row[:width], roles)
    imgui.end_table()


def _draw_row(words: Sequence[str], roles: Sequence[str]) -> None:
    """Declare a row, faint in columns that are not read."""
    if not words:
        return
    imgui.table_next_row()
    for column, word in enumerate(words):
        imgui.table_set_column_index(column)
        draw = imgui.text_disabled if roles[column] in UNREAD else imgui.text_unformatted
        draw(printable(word))
