"""The dialog that finds a scan: a folder's scans, and those opened lately."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ...document.recording import is_recording
from ...document.saved_session import is_session
from ...files import absolute, printable, working_folder
from ...scan.listing import Listed, list_folder
from ...scan.open import DEMO, is_demo
from ...task import Task, in_background
from .. import theme, widgets
from ..session import Session, known_as
from .opening import Opening
from .places import KnownPlace, known_places
from .preview import Previewer
from .scans import Scans, title
from .sessions import Sessions

_TITLE = "Open a scan"
_SIZE = ImVec2(72.0, 36.0)  # in heights of the font
_KNOWN_SHARE, _PREVIEW_SHARE = 0.2, 0.26  # of the width
_KNOWN_LEAST = 9.5  # the same of the known places, in heights of the font
_ICON_ROOM, _COUNT_ROOM, _DATE_ROOM = 1.6, 5.5, 5.5  # in heights of the font
_NAME_ROOM = 7.0  # that a name has at least, before the columns beside it
_LINGERS = 0.15  # seconds that a row is chosen before its scan is read
_PAGE = 10  # rows
_ROW_KEYS = (
    imgui.Key.down_arrow, imgui.Key.up_arrow, imgui.Key.left_arrow, imgui.Key.right_arrow,
    imgui.Key.page_down, imgui.Key.page_up, imgui.Key.enter, imgui.Key.keypad_enter,
)  # fmt: skip
_OWNER = 2  # of these: any number of its own
_HINT = "You can also drop files, folders and recordings onto the window."
_ICONS = {
    "whole": icons.ICON_FA_FILM, "folder": icons.ICON_FA_FOLDER, "sequence": icons.ICON_FA_FILM,
    "file": icons.ICON_FA_CUBE,
}  # fmt: skip


class Browser:
    """The folder that the dialog shows, and what is chosen in it. A folder is listed beside the window.

    It stays open until what was chosen is open, and tells why that cannot be.

    is_open: whether the dialog is. refusal: why what was chosen could not be opened, in words.
    """

    def __init__(
        self,
        session: Session,
        scans: Scans,
        sessions: Sessions,
        opening: Opening,
        open: Callable[[str], None],
        replay: Callable[[Path], None],
        take_file: Callable[[Path], bool],
        previewer: Previewer,
    ) -> None:
        """opening: what opens scans. open: opens a scan that was opened before. replay: shows a recording.
        take_file: has a tool take a file that is its own."""
        self._session, self._scans, self._sessions, self._opening = session, scans, sessions, opening
        self._open_again, self._replay, self._previewer = open, replay, previewer
        self._take_file = take_file
        self._folder = working_folder()
        self._asked = False  # to be opened
        self.is_open = self._is_done = False
        self._asks_for: str | None = None  # what is being opened
        self.refusal = ""  # why that could not be
        self._all: list[Listed] = []  # in the folder
        self._rows: list[Listed] = []  # those whose names have the filter in them
        self._filter = ""
        self._places: list[KnownPlace] = []
        self._looking: Future[list[KnownPlace]] | None = None
        self._chosen_at = 0.0  # by the clock, when another row was chosen
        self._problem: str | None = None
        self._listing: Future[list[Listed]] | None = None
        self._chosen = 0  # row
        self._scroll = False  # to the chosen row
        self._select = ""  # the path to choose once it is listed
        self._text = ""

    def show(self, folder: Path | None = None) -> None:
        """Open the dialog on a folder; None: that of the open scan, that scan chosen."""
        self._asked, self._asks_for = True, None
        self._looking = in_background(Task("Looking for disks"), known_places)
        if folder is not None:
            self._go(folder)
            return
        scan = self._session.scan
        here = self._folder if is_demo(scan) else Path(known_as(scan)).parent
        self._go(here, "" if is_demo(scan) else known_as(scan))

    @property
    def waits(self) -> bool:
        """Whether a folder is being listed, or a preview drawn."""
        lingers = self.is_open and time.monotonic() - self._chosen_at < 2 * _LINGERS
        return self._listing is not None or self._previewer.waits or lingers

    def opened(self) -> None:
        """Take in that a scan was opened: the dialog closes where it waited for one."""
        self._is_done = self._asks_for is not None
        self._asks_for = None

    def refused(self, problem: str) -> bool:
        """Take in why nothing was opened; whether the dialog waited for that, and tells it."""
        if self._asks_for is None:
            return False
        self._asks_for, self.refusal = None, problem
        return True

    def advance(self) -> bool:
        """Take in the folder's list and the preview; whether anything has come."""
        if self._looking is not None and self._looking.done():
            looking, self._looking = self._looking, None
            self._places = [] if looking.exception() else looking.result()
        changed = self._previewer.advance()
        if self.is_open and time.monotonic() - self._chosen_at > _LINGERS:
            row = self._row
            self._previewer.ask(row.path if row is not None and row.frames else None)
        return self._take_list() or changed

    def _take_list(self) -> bool:
        if self._listing is None or not self._listing.done():
            return False
        listing, self._listing = self._listing, None
        try:
            self._all, self._problem = listing.result(), None
        except Exception as error:  # whatever a file system brings, the window stays
            self._all, self._problem = [], str(error)
        self._narrow(self._filter)
        return True

    @property
    def _row(self) -> Listed | None:
        """The row that is chosen."""
        return self._rows[self._chosen] if self._rows else None

    def _narrow(self, filter: str) -> None:
        """List what has this in its name, in any case; the row that was chosen stays so where it is there."""
        row = self._row
        chosen = self._select or (row.path if row else "")
        self._filter, self._select = filter, ""
        self._rows = [one for one in self._all if filter.strip().lower() in one.title.lower()]
        paths = [one.path for one in self._rows]
        self._choose(paths.index(chosen) if chosen in paths else 0, scroll=True)

    def _choose(self, number: int, scroll: bool = False) -> None:
        self._chosen, self._scroll, self._chosen_at = number, scroll, time.monotonic()

    def draw(self, color: int) -> None:
        """Declare the dialog where it is open. color: 0xRRGGBB, of what tells that something went wrong."""
        if self._asked:
            imgui.open_popup(_TITLE)
            self._asked, self._is_done, self.refusal = False, False, ""
        em, display = imgui.get_font_size(), imgui.get_io().display_size
        size = ImVec2(min(_SIZE.x * em, 0.94 * display.x), min(_SIZE.y * em, 0.9 * display.y))
        imgui.set_next_window_size(size, imgui.Cond_.always)
        imgui.set_next_window_pos(display * 0.5, imgui.Cond_.appearing, ImVec2(0.5, 0.5))
        flags = imgui.WindowFlags_.no_saved_settings | imgui.WindowFlags_.no_resize
        is_open, stays = imgui.begin_popup_modal(_TITLE, True, flags)
        self.is_open = is_open
        if is_open:
            self._draw_inside(color)
            if not stays or imgui.is_key_pressed(imgui.Key.escape):
                self._give_up()
            if self._is_done:
                imgui.close_current_popup()
                self._is_done = False
            imgui.end_popup()
        elif not self._asked:
            self._sessions.homeless, self._asks_for = None, None  # the user gave up
            self._previewer.ask(None)

    # --- what the user does -----------------------------------------------------------

    def _go(self, folder: Path, select: str = "") -> None:
        """Show a folder."""
        self._folder, self._select = folder, select
        self._text, self.refusal, self._filter = str(folder), "", ""
        self._all, self._rows, self._problem, self._chosen = [], [], None, 0
        self._listing = in_background(Task("Listing a folder"), lambda: list_folder(folder))

    def _go_up(self) -> None:
        self._go(self._folder.parent, str(self._folder))

    def _enter_text(self) -> None:
        """Go to the folder that was typed, or open the scan."""
        path = absolute(os.path.expanduser(self._text.strip()))
        if os.path.isdir(path):
            self._go(Path(path))
        elif self._text.strip():
            self._open(path)

    def _give_up(self) -> None:
        """Close the dialog; what it waits for is not opened."""
        if self._asks_for is not None:
            self._opening.cancel()
        imgui.close_current_popup()

    def _open(self, scan: str) -> None:
        self._asks_for, self.refusal = scan, ""
        if is_session(Path(scan)):
            self._sessions.open(Path(scan))
        elif (session := self._sessions.homeless) is not None:
            self._sessions.open_with(session, scan)
        elif is_recording(Path(scan)):
            self._replay(Path(scan))
            self.opened()
        elif self._take_file(Path(scan)):
            self.opened()
        else:
            self._scans.open([scan])

    def _take(self, row: Listed) -> None:
        """Open a scan, or go into a folder that is none."""
        if row.frames:
            self._open(row.path)
        else:
            self._go(Path(row.path))

    # --- widgets ----------------------------------------------------------------------

    def _draw_inside(self, color: int) -> None:
        self._take_keys()  # before the field for the path lets go of them
        self._draw_path()
        if self.refusal:
            imgui.push_style_color(imgui.Col_.text, theme.packed(color))
            imgui.text(icons.ICON_FA_TRIANGLE_EXCLAMATION)
            imgui.pop_style_color()
            imgui.same_line()
            imgui.text_wrapped(printable(self.refusal))
        foot = imgui.get_frame_height_with_spacing() + imgui.get_style().item_spacing.y
        width = imgui.get_content_region_avail().x
        known = max(_KNOWN_SHARE * width, _KNOWN_LEAST * imgui.get_font_size())
        imgui.begin_child("known", ImVec2(known, -foot), imgui.ChildFlags_.borders)
        self._draw_known()
        imgui.end_child()
        imgui.same_line()
        preview = _PREVIEW_SHARE * width + imgui.get_style().item_spacing.x
        imgui.begin_child("folder", ImVec2(-preview, -foot), imgui.ChildFlags_.borders)
        self._draw_filter()
        imgui.begin_child("rows")
        self._draw_rows()
        imgui.end_child()
        imgui.end_child()
        imgui.same_line()
        imgui.begin_child("preview", ImVec2(0, -foot))
        self._draw_preview()
        imgui.end_child()
        self._draw_foot()

    def _draw_filter(self) -> None:
        imgui.set_next_item_width(-1)
        changed, text = imgui.input_text_with_hint("##filter", "Filter by name", self._filter)
        if changed:
            self._narrow(text)

    def _draw_preview(self) -> None:
        self._previewer.draw_picture()
        if (row := self._row) is not None:
            imgui.text_wrapped(printable(row.title))
            imgui.text_wrapped(printable(self._previewer.words))
            told = [size_in_words(row.size), date_in_words(row.changed, "%Y-%m-%d %H:%M")]
            imgui.text_disabled(", ".join(filter(None, told)))

    def _draw_path(self) -> None:
        imgui.push_item_flag(imgui.ItemFlags_.no_tab_stop, True)  # the first Tab goes to the field
        if widgets.icon_button(icons.ICON_FA_ARROW_UP, "Parent folder (Backspace)"):
            self._go_up()
        imgui.pop_item_flag()
        imgui.same_line()
        imgui.set_next_item_width(-1)
        returns = imgui.InputTextFlags_.enter_returns_true
        entered, self._text = widgets.edit_path("##path", self._text, returns)
        widgets.tooltip("Folder, file, or pattern such as frame%04d.ply; Enter opens it")
        if entered:
            imgui.set_nav_cursor_visible(False)  # the next Enter is for the rows
            self._enter_text()

    def _draw_known(self) -> None:
        """Declare the places to look in, and the lists of what can be opened at once, wherever it is."""
        imgui.text_disabled("Places")
        for place in self._places:
            if imgui.selectable(
                widgets.labelled(f"{place.icon}  {place.title}", place.title), place.folder == self._folder
            )[0]:
                self._go(place.folder)
            widgets.tooltip(printable(str(place.folder)))
        is_open = self._session.scan == DEMO
        if imgui.selectable(f"{icons.ICON_FA_CUBE}  Demo scan###Demo scan", is_open)[0]:
            self._open_known(DEMO)
        imgui.spacing()
        scans = self._scans
        if scans.are_together:
            self._draw_names("Opened together", scans.listed)
            imgui.spacing()
        self._draw_names("Recent", scans.lately)

    def _draw_names(self, head: str, scans: Sequence[str]) -> None:
        imgui.text_disabled(head)
        imgui.push_id(head)
        for number, scan in enumerate(scans):
            name = widgets.fitted(title(scan), imgui.get_content_region_avail().x)
            is_open = known_as(scan) == known_as(self._session.scan)
            if imgui.selectable(widgets.labelled(name, number), is_open)[0]:
                self._open_known(scan)
            widgets.tooltip(printable(scan))
        if not scans:
            imgui.text("none")
        imgui.pop_id()

    def _open_known(self, scan: str) -> None:
        self._asks_for, self.refusal = scan, ""
        self._open_again(scan)

    def _take_keys(self) -> None:
        """Arrows choose, Enter opens, Backspace goes up, letters filter; not while a field takes them, or Tab
        has led the keyboard elsewhere."""
        if imgui.is_window_appearing():
            imgui.set_nav_cursor_visible(False)
        if imgui.is_any_item_active() or imgui.get_io().nav_visible:
            return
        for key in _ROW_KEYS:  # else ImGui takes them to go through the widgets
            imgui.internal.set_key_owner(key, _OWNER)
        last = len(self._rows) - 1
        for key, by in (
            (imgui.Key.down_arrow, 1), (imgui.Key.up_arrow, -1),
            (imgui.Key.page_down, _PAGE), (imgui.Key.page_up, -_PAGE),
        ):  # fmt: skip
            if imgui.is_key_pressed(key) and self._rows:
                self._choose(min(max(self._chosen + by, 0), last), scroll=True)
        row = self._row
        if typed := _typed():
            self._narrow(self._filter + typed)
        elif self._filter and imgui.is_key_pressed(imgui.Key.backspace):
            self._narrow(self._filter[:-1])
        elif _is_pressed(imgui.Key.backspace, imgui.Key.left_arrow):
            self._go_up()
        elif row and row.kind == "folder" and _is_pressed(imgui.Key.right_arrow):
            self._go(Path(row.path))
        elif row and _is_pressed(imgui.Key.enter, imgui.Key.keypad_enter):
            self._take(row)

    def _draw_rows(self) -> None:
        if not self._rows:
            nothing = f"No name contains '{self._filter}'." if self._all else "No scans in this folder."
            told = "Reading ..." if self._listing else self._problem or nothing
            imgui.text_wrapped(printable(told))
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
                self._go(Path(row.path))
        imgui.pop_id()
        if clicked:
            self._choose(number)
            if imgui.is_mouse_double_clicked(0) or imgui.get_io().nav_visible:
                self._take(row)

    def _draw_words(self, row: Listed, width: float, faint: bool) -> None:
        """Write the words of a row. faint: those beside its name, which need the usual ground for that."""
        em, left = imgui.get_font_size(), imgui.get_cursor_pos_x()
        beside = imgui.text_disabled if faint else imgui.text
        imgui.align_text_to_frame_padding()
        beside(_ICONS[row.kind])
        imgui.same_line(left + _ICON_ROOM * em)
        columns = [
            (_COUNT_ROOM * em, f"{row.frames} frames" if row.frames > 1 else size_in_words(row.size)),
            (_DATE_ROOM * em, date_in_words(row.changed)),
        ]
        room = width - _ICON_ROOM * em
        while columns and room - sum(wide for wide, _ in columns) < _NAME_ROOM * em:
            columns.pop()
        imgui.text(widgets.fitted(printable(row.title), room - sum(wide for wide, _ in columns)))
        for number, (_, text) in enumerate(columns):
            imgui.same_line(left + width - sum(wide for wide, _ in columns[number:]))
            beside(text)

    def _draw_foot(self) -> None:
        row = self._row
        goes = row is not None and not row.frames
        texts = ("Go" if goes else "Open", "Cancel")
        padding, gap = imgui.get_style().frame_padding.x, imgui.get_style().item_spacing.x
        room = sum(imgui.calc_text_size(text).x + 2 * padding for text in texts) + gap
        left = imgui.get_content_region_avail().x - room
        imgui.align_text_to_frame_padding()
        waits = self._asks_for is not None
        told = f"Opening {printable(title(self._asks_for))} ..." if self._asks_for is not None else _HINT
        imgui.text_disabled(widgets.fitted(told, left - gap))
        imgui.same_line(imgui.get_cursor_start_pos().x + left)
        imgui.begin_disabled(row is None or waits)
        if imgui.button(texts[0]) and row is not None:
            self._take(row)
        imgui.end_disabled()
        imgui.same_line()
        if imgui.button(texts[1]):
            self._give_up()


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
