"""The folder that a dialog shows: known folders, its path, and rows of what is in it."""

from __future__ import annotations

import os
import string
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ...document.saved_session import is_session
from ...files import absolute, printable, working_folder
from ...scan.listing import Listed
from ...task import Task, in_background
from .. import widgets

_ICON_ROOM, _COUNT_ROOM, _DATE_ROOM = 1.6, 5.5, 5.5  # in heights of the font
_NAME_ROOM = 7.0  # that a name has at least, before the columns beside it
_PAGE = 10  # rows
_ROW_KEYS = (
    imgui.Key.down_arrow, imgui.Key.up_arrow, imgui.Key.left_arrow, imgui.Key.right_arrow,
    imgui.Key.page_down, imgui.Key.page_up, imgui.Key.enter, imgui.Key.keypad_enter,
)  # fmt: skip
_STEPS = {
    imgui.Key.down_arrow: 1, imgui.Key.up_arrow: -1, imgui.Key.page_down: _PAGE, imgui.Key.page_up: -_PAGE,
}  # fmt: skip
_OWNER = 2  # of these: any number of its own
_ICONS = {
    "whole": icons.ICON_FA_FILM, "folder": icons.ICON_FA_FOLDER, "sequence": icons.ICON_FA_FILM,
    "file": icons.ICON_FA_CUBE,
}  # fmt: skip


@dataclass(frozen=True)
class KnownFolder:
    """A folder by the name that users know it by. icon: beside its name."""

    title: str
    icon: str
    folder: Path


def known_folders() -> list[KnownFolder]:
    """Home, desktop, documents and downloads where they are there, then disks. It may wait for a disk."""
    import platformdirs

    own = [
        KnownFolder("Home", icons.ICON_FA_HOUSE, Path(os.path.expanduser("~"))),
        KnownFolder("Desktop", icons.ICON_FA_DISPLAY, platformdirs.user_desktop_path()),
        KnownFolder("Documents", icons.ICON_FA_FILE_LINES, platformdirs.user_documents_path()),
        KnownFolder("Downloads", icons.ICON_FA_DOWNLOAD, platformdirs.user_downloads_path()),
    ]
    disks = [KnownFolder(_disk_title(disk), icons.ICON_FA_HARD_DRIVE, disk) for disk in _disks()]
    there = [known for known in own + disks if os.path.isdir(known.folder)]
    return list({known.folder: known for known in reversed(there)}.values())[::-1]  # the first of each folder


def _disk_title(disk: Path) -> str:
    return "This computer" if str(disk) == "/" else disk.name or str(disk)


def _disks() -> Iterator[Path]:
    """The roots of disks, and what is plugged in."""
    if sys.platform == "win32":
        yield from (Path(f"{letter}:\\") for letter in string.ascii_uppercase)
        return
    yield Path("/")
    user = os.path.basename(os.path.expanduser("~"))
    for mounted in (Path("/Volumes"), Path("/media") / user, Path("/run/media") / user, Path("/mnt")):
        try:
            yield from sorted(mounted.iterdir())
        except OSError:
            continue


class FolderView:
    """A folder, listed beside the window, and the row that is chosen in it.

    folder: that is shown. refusal: why what was chosen last could not be used, in words. chosen_at: by the
    clock, when another row was chosen. filter: the part of a name that all rows have.
    """

    def __init__(
        self,
        list_folder: Callable[[Path], list[Listed]],
        take: Callable[[str], None],
        *,
        choose: Callable[[Listed], None] = lambda row: None,
        nothing: str,
        filters: bool = False,
    ) -> None:
        """take: uses a path that the user has picked or typed, and that is no folder to go into. choose:
        takes the row that the user has moved to. nothing: the words on a folder without rows. filters:
        whether letters that are typed narrow the rows."""
        self._list_folder, self._take_path, self._on_choice = list_folder, take, choose
        self._nothing, self._filters = nothing, filters
        self.folder = working_folder()
        self.refusal = ""
        self.filter = ""
        self.chosen_at = 0.0
        self._all: list[Listed] = []  # in the folder
        self._rows: list[Listed] = []  # those whose names have the filter in them
        self._known: list[KnownFolder] = []
        self._looking: Future[list[KnownFolder]] | None = None
        self._problem: str | None = None
        self._listing: Future[list[Listed]] | None = None
        self._chosen = 0  # row
        self._scroll = False  # to the chosen row
        self._select = ""  # the path to choose once it is listed
        self._text = ""

    @property
    def waits(self) -> bool:
        """Whether the folder is being listed."""
        return self._listing is not None

    def show(self, folder: Path, select: str = "") -> None:
        """Show a folder in a dialog that opens. select: the path to choose in it."""
        self._looking = in_background(Task("Looking for disks"), known_folders)
        self.go(folder, select)

    def advance(self) -> bool:
        """Take in the known folders and the folder's list; whether that has come."""
        if self._looking is not None and self._looking.done():
            looking, self._looking = self._looking, None
            self._known = [] if looking.exception() else looking.result()
        return self._take_list()

    def _take_list(self) -> bool:
        if self._listing is None or not self._listing.done():
            return False
        listing, self._listing = self._listing, None
        try:
            self._all, self._problem = listing.result(), None
        except Exception as error:  # whatever a file system brings, the window stays
            self._all, self._problem = [], str(error)
        self.narrow(self.filter)
        return True

    @property
    def row(self) -> Listed | None:
        """The row that is chosen."""
        return self._rows[self._chosen] if self._rows else None

    def narrow(self, filter: str) -> None:
        """List what has this in its name, in any case; the row that was chosen stays so where it is there."""
        row = self.row
        chosen = self._select or (row.path if row else "")
        self.filter, self._select = filter, ""
        self._rows = [one for one in self._all if filter.strip().lower() in one.title.lower()]
        paths = [one.path for one in self._rows]
        self._choose(paths.index(chosen) if chosen in paths else 0, scroll=True)

    def _choose(self, number: int, scroll: bool = False) -> None:
        self._chosen, self._scroll, self.chosen_at = number, scroll, time.monotonic()

    # --- what the user does -----------------------------------------------------------

    def go(self, folder: Path, select: str = "") -> None:
        """Show a folder. select: the path to choose in it."""
        self.folder, self._select = folder, select
        self._text, self.refusal, self.filter = str(folder), "", ""
        self._all, self._rows, self._problem, self._chosen = [], [], None, 0
        self._listing = in_background(Task("Listing a folder"), lambda: self._list_folder(folder))

    def go_up(self) -> None:
        """Show the folder above."""
        self.go(self.folder.parent, str(self.folder))

    def take(self, row: Listed) -> None:
        """Use what a row names, or go into a folder that is nothing else."""
        if row.frames:
            self._take_path(row.path)
        else:
            self.go(Path(row.path))

    def _enter_text(self) -> None:
        """Go to the folder that was typed, or use the path."""
        path = absolute(os.path.expanduser(self._text.strip()))
        if os.path.isdir(path):
            self.go(Path(path))
        elif self._text.strip():
            self._take_path(path)

    def take_keys(self, field: bool = False) -> None:
        """Arrows choose, Enter takes, Backspace goes up, letters filter; not while a field takes them, or Tab
        has led the keyboard elsewhere. field: whether Up and Down leave the field that takes letters."""
        if imgui.is_window_appearing():
            imgui.set_nav_cursor_visible(False)
        steps = [by for key, by in _STEPS.items() if imgui.is_key_pressed(key)]
        leaves_field = field and imgui.is_any_item_active()
        if not leaves_field and (imgui.is_any_item_active() or imgui.get_io().nav_visible):
            return
        for key in _STEPS if leaves_field else _ROW_KEYS:  # else ImGui takes them to go through the widgets
            imgui.internal.set_key_owner(key, _OWNER)
        if leaves_field:
            if not (steps and self._rows):
                return
            imgui.internal.clear_active_id()
            imgui.set_nav_cursor_visible(False)
        for by in steps if self._rows else ():
            self._move(min(max(self._chosen + by, 0), len(self._rows) - 1), scroll=True)
        row = self.row
        if self._filters and (typed := _typed()):
            self.narrow(self.filter + typed)
        elif self.filter and imgui.is_key_pressed(imgui.Key.backspace):
            self.narrow(self.filter[:-1])
        elif _is_pressed(imgui.Key.backspace, imgui.Key.left_arrow):
            self.go_up()
        elif row and row.kind == "folder" and _is_pressed(imgui.Key.right_arrow):
            self.go(Path(row.path))
        elif row and _is_pressed(imgui.Key.enter, imgui.Key.keypad_enter):
            self.take(row)

    def _move(self, number: int, scroll: bool = False) -> None:
        self._choose(number, scroll)
        self._on_choice(self._rows[number])

    # --- widgets ----------------------------------------------------------------------

    def draw_path(self) -> None:
        """Declare the path."""
        imgui.push_item_flag(imgui.ItemFlags_.no_tab_stop, True)  # the first Tab goes to the field
        if widgets.icon_button(icons.ICON_FA_ARROW_UP, "Parent folder (Backspace)"):
            self.go_up()
        imgui.pop_item_flag()
        imgui.same_line()
        imgui.set_next_item_width(-1)
        returns = imgui.InputTextFlags_.enter_returns_true
        entered, self._text = widgets.edit_path("##path", self._text, returns)
        widgets.tooltip(
            "Type a folder, a file, or a pattern such as frame%04d.ply, and press Enter to open it"
        )
        if entered:
            imgui.set_nav_cursor_visible(False)  # the next Enter is for the rows
            self._enter_text()

    def draw_refusal(self) -> None:
        """Declare why what was chosen last was refused, if it was."""
        if self.refusal:
            imgui.text_wrapped(f"{icons.ICON_FA_TRIANGLE_EXCLAMATION}  {printable(self.refusal)}")

    def draw_known_folders(self) -> None:
        """Declare the folders to look in."""
        imgui.text_disabled("Folders")
        for known in self._known:
            label = widgets.labelled(f"{known.icon}  {known.title}", known.title)
            if imgui.selectable(label, known.folder == self.folder)[0]:
                self.go(known.folder)
            widgets.tooltip(printable(str(known.folder)))

    def draw_rows(self) -> None:
        """Declare the rows, in a window that scrolls."""
        if not self._rows:
            nothing = f"No name in this folder contains '{self.filter}'." if self._all else self._nothing
            shown = "Reading ..." if self._listing else self._problem or nothing
            imgui.text_wrapped(printable(shown))
            return
        clipper = imgui.ListClipper()
        clipper.begin(len(self._rows))
        if self._scroll:
            clipper.include_item_by_index(self._chosen)
        while clipper.step():
            for number in range(clipper.display_start, clipper.display_end):
                if number < len(self._rows):  # a click may have gone elsewhere
                    self._draw_row(number, self._rows[number])

    def _draw_row(self, number: int, row: Listed) -> None:
        imgui.push_id(number)
        height = imgui.get_frame_height()
        size = ImVec2(imgui.get_content_region_avail().x - 1.3 * height, height)
        start = imgui.get_cursor_pos()
        flags = imgui.SelectableFlags_.allow_double_click | imgui.SelectableFlags_.no_auto_close_popups
        imgui.push_style_color(imgui.Col_.header, imgui.get_color_u32(imgui.Col_.button_active))
        clicked, _ = imgui.selectable("##row", number == self._chosen, flags, size)
        imgui.pop_style_color()
        if number == self._chosen and self._scroll:
            imgui.set_scroll_here_y(0.5)
            self._scroll = False
        imgui.set_cursor_pos(start)
        self._draw_words(row, size.x, faint=number != self._chosen)
        if row.kind == "folder" and row.frames:
            imgui.same_line(start.x + size.x)
            if widgets.icon_button(icons.ICON_FA_ANGLE_RIGHT, "Open this folder (Right)"):
                self.go(Path(row.path))
        imgui.pop_id()
        if clicked:
            self._move(number)
            if imgui.is_mouse_double_clicked(0) or imgui.get_io().nav_visible:
                self.take(row)

    def _draw_words(self, row: Listed, width: float, faint: bool) -> None:
        """Write the words of a row. faint: those beside its name, which need the usual ground for that."""
        em, left = imgui.get_font_size(), imgui.get_cursor_pos_x()
        beside = imgui.text_disabled if faint else imgui.text
        imgui.align_text_to_frame_padding()
        beside(icons.ICON_FA_BOOKMARK if is_session(Path(row.path)) else _ICONS[row.kind])
        imgui.same_line(left + _ICON_ROOM * em)
        columns = [
            (_COUNT_ROOM * em, f"{row.frames} frames" if row.frames > 1 else size_in_words(row.size)),
            (_DATE_ROOM * em, date_in_words(row.changed)),
        ]
        room = width - _ICON_ROOM * em
        while columns and room - sum(wide for wide, _ in columns) < _NAME_ROOM * em:
            columns.pop()
        name_room = room - sum(wide for wide, _ in columns) - imgui.get_style().item_spacing.x
        imgui.text(widgets.fitted(printable(row.title), name_room))
        for number, (_, text) in enumerate(columns):
            imgui.same_line(left + width - sum(wide for wide, _ in columns[number:]))
            beside(text)


def size_in_words(size: int | None) -> str:
    """A number of bytes as users read it, "1.2 MB"; nothing for None."""
    if size is None:
        return ""
    number = float(size)
    for unit in ("B", "kB", "MB", "GB"):
        if number < 1000 or unit == "GB":
            break
        number /= 1000
    return f"{number:.0f} {unit}" if unit == "B" or number >= 10 else f"{number:.1f} {unit}"


def date_in_words(changed: float | None, form: str = "%Y-%m-%d") -> str:
    """A moment, seconds since 1970, as the local date; nothing for None, or beyond the calendar."""
    try:
        return "" if changed is None else time.strftime(form, time.localtime(changed))
    except (OverflowError, ValueError, OSError):
        return ""


def _typed() -> str:
    """The letters that were typed since the frame before."""
    io = imgui.get_io()
    if io.key_ctrl or io.key_alt:
        return ""
    return "".join(chr(letter) if isinstance(letter, int) else letter for letter in io.input_queue_characters)


def _is_pressed(*keys: imgui.Key) -> bool:
    """Whether one of the keys was pressed just now; holding it down does not count."""
    return any(imgui.is_key_pressed(key, repeat=False) for key in keys)
