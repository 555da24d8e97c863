"""The dialog of text tables: the first lines, the role of each column, and how the numbers are written."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ...errors import InputError
from ...files import printable
from ...scan.formats.text import SUFFIXES
from ...scan.reading.corrections import ROLES, Corrections
from ...scan.reading.tables import TablePreview, preview
from ...task import Task, in_background
from .. import widgets
from ..commands import Command
from ..part import ViewArea, WindowPart
from ..playing.playback import Playback

TITLE = "Read table"
AUTO = "auto"  # choice that leaves a decision to Scan4D
SEPARATORS = {
    "blank": "blanks", "tab": "tabs", "comma": "commas", "semicolon": "semicolons", "bar": "bars",
}  # fmt: skip
DECIMALS = {".": "point (1.5)", ",": "comma (1,5)"}
_ROLE_TITLES = {
    "-": "not read",
    "r": "red",
    "g": "green",
    "b": "blue",
    "a": "alpha",
}
_SIZE = ImVec2(52.0, 34.0)  # in heights of the font
_MOST_COLUMNS = 60  # that the dialog shows
_COLUMN = 6.5  # width, in heights of the font
_LINES_ABOVE = 4  # that are shown at once


def is_table(scan: str | Path) -> bool:
    """Whether a file is a text table, by its name."""
    return Path(scan).suffix.lower() in SUFFIXES


class TableChoices:
    """Choices of the user about one table. No widgets.

    path: of the table. texts: corrections as `--read` takes them, only those that the user made. shown: what
    the table is with these; None until it was read. problem: why the choices are unusable; empty if usable.
    """

    KEYS = ("columns", "separator", "decimal", "skip")

    def __init__(self, path: Path, texts: Mapping[str, str]) -> None:
        """texts: corrections that hold now, also those of other keys, such as the encoding."""
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
        try:
            corrections = Corrections.parse({**self._others, **self.texts})
            self.problem = ""
        except InputError as error:  # roles that are not whole yet: the rows are still shown
            self.problem = error.hint or str(error)
            rest = {key: text for key, text in self.texts.items() if key != "columns"}
            corrections = Corrections.parse({**self._others, **rest})
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
            self.problem = self.problem or self.shown.problem
        return True


@dataclass(eq=False)
class TableDialog(WindowPart):
    """The dialog. choices: about the table that it shows, None while it is closed."""

    name = "table_dialog"
    doing = "Reading a table"
    layer = 82
    shows = "The dialog of tables"
    OFFERS = {"ask_for_table": "ask"}
    CONDITIONS = {"text table": lambda dialog: dialog.table is not None}
    playback: Playback
    correct_reading: Callable[..., None]

    def __post_init__(self) -> None:
        self.choices: TableChoices | None = None
        self._scan: str | None = None  # to open; None: the open one
        self._takes_keyboard = False

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
            self.choices, self._scan, self._takes_keyboard = TableChoices(path, held), scan, True

    @property
    def waits(self) -> bool:
        """Whether the table is being read."""
        return self.choices is not None and self.choices.waits

    def advance(self, now: float) -> bool:
        """Take in what was read."""
        return self.choices is not None and self.choices.advance()

    def _open(self) -> None:
        choices, self.choices = self.choices, None
        if choices is not None:
            self.correct_reading(choices.corrections, self._scan)

    def dialog(self, view: ViewArea) -> None:
        """Declare it while it is open."""
        em, display = imgui.get_font_size(), imgui.get_io().display_size
        size = ImVec2(min(_SIZE.x * em, 0.94 * display.x), min(_SIZE.y * em, 0.9 * display.y))
        with widgets.modal(TITLE, self.choices is not None, size) as is_drawn:
            if is_drawn and self.choices is not None:
                _draw_choices(self.choices)
                self._draw_foot(self.choices)
                if self.choices is None:
                    imgui.close_current_popup()

    def _draw_foot(self, choices: TableChoices) -> None:
        """Declare the problem and the buttons."""
        if choices.problem:
            imgui.text_wrapped(f"{icons.ICON_FA_TRIANGLE_EXCLAMATION}  {printable(choices.problem)}")
        elif choices.shown is not None:
            imgui.text_disabled("Scan4D reads the rows of this table as points.")
        imgui.begin_disabled(not choices.can_open)
        if self._takes_keyboard and choices.can_open:
            imgui.set_keyboard_focus_here()
            self._takes_keyboard = False
        opens = imgui.button("Open")
        imgui.end_disabled()
        opens = (widgets.is_taken() and choices.can_open) or opens
        imgui.same_line()
        if imgui.button("Reset"):
            choices.reset()
        widgets.tooltip("Leave all choices to Scan4D")
        imgui.same_line()
        leaves = imgui.button("Cancel") or imgui.is_key_pressed(imgui.Key.escape)
        if opens:
            self._open()
        elif leaves:
            self.choices = None

    COMMANDS = (Command("read_table", "Read table...", ask, when="text table"),)


def _draw_choices(choices: TableChoices) -> None:
    """Declare the choices about all lines, and the rows with a role for each column."""
    imgui.text_wrapped(printable(choices.path.name))
    shown = choices.shown
    if shown is None:
        return
    _draw_word(choices, "separator", "Separator", SEPARATORS, shown.separator)
    _draw_word(choices, "decimal", "Decimal mark", DECIMALS, shown.decimal)
    widgets.label("Lines to skip", "Number of lines above the first row of values; Scan4D skips them")
    changed, lines = imgui.input_int("##skip", shown.skip, 1, 10)
    if changed:
        choices.state("skip", str(max(lines, 0)))
    _draw_above(shown.lines[: shown.skip])
    foot = imgui.get_text_line_height_with_spacing() + imgui.get_frame_height_with_spacing()
    if choices.problem:
        room = imgui.get_content_region_avail().x
        foot += imgui.calc_text_size(f"     {choices.problem}", wrap_width=room).y
    _draw_rows(choices, shown.cells, -foot)


def _draw_word(choices: TableChoices, key: str, title: str, words: Mapping[str, str], found: str) -> None:
    """Declare a combo of one key. found: what Scan4D reads now."""
    widgets.label(title)
    stated = choices.texts.get(key, AUTO)
    titles = {**words, AUTO: f"automatic: {words.get(found, found)}"}
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


def _draw_rows(choices: TableChoices, cells: Sequence[Sequence[str]], height: float) -> None:
    """Declare the first rows, below a role for each column. height: of the table, negative: from the foot."""
    width = min(max(map(len, cells), default=0), _MOST_COLUMNS)
    flags = imgui.TableFlags_.borders | imgui.TableFlags_.row_bg | imgui.TableFlags_.scroll_x
    flags |= imgui.TableFlags_.scroll_y | imgui.TableFlags_.sizing_fixed_fit
    if not width or not imgui.begin_table("rows", width, flags, ImVec2(0, height)):
        return
    column_width = _COLUMN * imgui.get_font_size()
    for column in range(width):
        imgui.table_setup_column(str(column), imgui.TableColumnFlags_.width_fixed, column_width)
    imgui.table_setup_scroll_freeze(0, 1)
    imgui.table_next_row()
    roles = choices.roles
    for column in range(width):
        imgui.table_set_column_index(column)
        imgui.set_next_item_width(-1)
        words = list(ROLES) if roles[column] in ROLES else [roles[column], *ROLES]
        role = widgets.combo(f"role {column}", roles[column], words, _ROLE_TITLES)
        if role != roles[column]:
            choices.state_role(column, role)
    for row in cells:
        imgui.table_next_row()
        for column, word in enumerate(row[:width]):
            imgui.table_set_column_index(column)
            imgui.text_unformatted(printable(word))
    imgui.end_table()
