"""The dialog that finds a scan: a folder's scans, and those opened lately."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ...document.recording import is_recording
from ...document.saved_session import is_session
from ...files import absolute, printable, working_folder
from ...scan.listing import Listed, list_folder
from ...scan.open import DEMO
from ...task import Task, in_background
from .. import widgets
from ..session import Session, known_as
from .scans import Scans, title
from .sessions import Sessions

_TITLE = "Open a scan"
_SIZE = ImVec2(54.0, 34.0)  # in heights of the font
_KNOWN_SHARE = 0.3  # of the width
_ICON_ROOM, _COUNT_ROOM = 1.6, 6.5  # in heights of the font
_PAGE = 10  # rows
_HINT = "Files, folders and recordings can also be dropped onto the window."
_ICONS = {
    "whole": icons.ICON_FA_FILM, "folder": icons.ICON_FA_FOLDER, "sequence": icons.ICON_FA_FILM,
    "file": icons.ICON_FA_CUBE,
}  # fmt: skip


class Browser:
    """The folder that the dialog shows, and what is chosen in it. A folder is listed beside the window."""

    def __init__(
        self,
        session: Session,
        scans: Scans,
        sessions: Sessions,
        open: Callable[[str], None],
        replay: Callable[[Path], None],
    ) -> None:
        """open: opens a scan that was opened before. replay: shows a recording."""
        self._session, self._scans, self._sessions = session, scans, sessions
        self._open_again, self._replay = open, replay
        self._folder = working_folder()
        self._asked = False  # to be opened
        self._rows: list[Listed] = []
        self._problem: str | None = None
        self._listing: Future[list[Listed]] | None = None
        self._chosen = 0  # row
        self._scroll = False  # to the chosen row
        self._select = ""  # the path to choose once it is listed
        self._text = ""

    def show(self, folder: Path | None = None) -> None:
        """Open the dialog on a folder; None: that of the open scan, that scan chosen."""
        self._asked = True
        if folder is not None:
            self._go(folder)
            return
        scan = self._session.scan
        here = self._folder if scan == DEMO else Path(known_as(scan)).parent
        self._go(here, "" if scan == DEMO else known_as(scan))

    @property
    def waits(self) -> bool:
        """Whether a folder is being listed."""
        return self._listing is not None

    def advance(self) -> bool:
        """Take in the folder's list; whether it has come."""
        if self._listing is None or not self._listing.done():
            return False
        listing, self._listing = self._listing, None
        try:
            self._rows, self._problem = listing.result(), None
        except Exception as error:  # whatever a file system brings, the window stays
            self._rows, self._problem = [], str(error)
        paths = [row.path for row in self._rows]
        self._chosen = paths.index(self._select) if self._select in paths else 0
        self._scroll = True
        return True

    def draw(self) -> None:
        """Declare the dialog where it is open."""
        if self._asked:
            imgui.open_popup(_TITLE)
            self._asked = False
        em, display = imgui.get_font_size(), imgui.get_io().display_size
        size = ImVec2(min(_SIZE.x * em, 0.94 * display.x), min(_SIZE.y * em, 0.9 * display.y))
        imgui.set_next_window_size(size, imgui.Cond_.always)
        imgui.set_next_window_pos(display * 0.5, imgui.Cond_.appearing, ImVec2(0.5, 0.5))
        flags = imgui.WindowFlags_.no_saved_settings | imgui.WindowFlags_.no_resize
        is_open, stays = imgui.begin_popup_modal(_TITLE, True, flags)
        if is_open:
            self._draw_inside()
            if not stays or imgui.is_key_pressed(imgui.Key.escape):
                imgui.close_current_popup()
            imgui.end_popup()
        elif not self._asked:
            self._sessions.homeless = None  # the user gave up

    # --- what the user does -----------------------------------------------------------

    def _go(self, folder: Path, select: str = "") -> None:
        """Show a folder."""
        self._folder, self._select = folder, select
        self._text = str(folder)
        self._rows, self._problem, self._chosen = [], None, 0
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

    def _open(self, scan: str) -> None:
        if is_session(Path(scan)):
            self._sessions.open(Path(scan))
        elif (session := self._sessions.homeless) is not None:
            self._sessions.open_with(session, scan)
        elif is_recording(Path(scan)):
            self._replay(Path(scan))
        else:
            self._scans.open([scan])
        imgui.close_current_popup()

    def _take(self, row: Listed) -> None:
        """Open a scan, or go into a folder that is none."""
        if row.frames:
            self._open(row.path)
        else:
            self._go(Path(row.path))

    # --- widgets ----------------------------------------------------------------------

    def _draw_inside(self) -> None:
        self._take_keys()  # before the field for the path lets go of them
        self._draw_path()
        foot = imgui.get_frame_height_with_spacing() + imgui.get_style().item_spacing.y
        width = imgui.get_content_region_avail().x
        imgui.begin_child("known", ImVec2(_KNOWN_SHARE * width, -foot), imgui.ChildFlags_.borders)
        self._draw_known()
        imgui.end_child()
        imgui.same_line()
        imgui.begin_child("folder", ImVec2(0, -foot), imgui.ChildFlags_.borders)
        self._draw_rows()
        imgui.end_child()
        self._draw_foot()

    def _draw_path(self) -> None:
        if widgets.icon_button(icons.ICON_FA_ARROW_UP, "The folder above (Backspace)"):
            self._go_up()
        imgui.same_line()
        imgui.set_next_item_width(-1)
        returns = imgui.InputTextFlags_.enter_returns_true
        entered, self._text = widgets.edit_path("##path", self._text, returns)
        widgets.tooltip("A folder, a file, or a pattern such as frame%04d.ply; Enter goes there")
        if entered:
            self._enter_text()

    def _draw_known(self) -> None:
        """Declare the lists of what can be opened at once, wherever it is."""
        scans = self._scans
        if scans.are_together:
            self._draw_names("Opened together", scans.listed)
            imgui.spacing()
        self._draw_names("Opened lately", scans.lately)

    def _draw_names(self, head: str, scans: Sequence[str]) -> None:
        imgui.text_disabled(head)
        imgui.push_id(head)
        for number, scan in enumerate(scans):
            name = widgets.fitted(title(scan), imgui.get_content_region_avail().x)
            is_open = known_as(scan) == known_as(self._session.scan)
            if imgui.selectable(f"{name}##{number}", is_open)[0]:
                self._open_again(scan)
                imgui.close_current_popup()
            widgets.tooltip(printable(scan))
        if not scans:
            imgui.text("none")
        imgui.pop_id()

    def _take_keys(self) -> None:
        """Arrows choose, Enter opens, Backspace goes up; not while a path is typed."""
        if imgui.is_any_item_active():
            return
        last = len(self._rows) - 1
        for key, by in (
            (imgui.Key.down_arrow, 1), (imgui.Key.up_arrow, -1),
            (imgui.Key.page_down, _PAGE), (imgui.Key.page_up, -_PAGE),
        ):  # fmt: skip
            if imgui.is_key_pressed(key) and self._rows:
                self._chosen, self._scroll = min(max(self._chosen + by, 0), last), True
        row = self._rows[self._chosen] if self._rows else None
        if _is_pressed(imgui.Key.backspace, imgui.Key.left_arrow):
            self._go_up()
        elif row and row.kind == "folder" and _is_pressed(imgui.Key.right_arrow):
            self._go(Path(row.path))
        elif row and _is_pressed(imgui.Key.enter, imgui.Key.keypad_enter):
            self._take(row)

    def _draw_rows(self) -> None:
        if not self._rows:
            told = "Reading ..." if self._listing else self._problem or "There are no scans here."
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
            if widgets.icon_button(icons.ICON_FA_ANGLE_RIGHT, "Look into this folder (Right)"):
                self._go(Path(row.path))
        imgui.pop_id()
        if clicked:
            self._chosen = number
            if imgui.is_mouse_double_clicked(0):
                self._take(row)

    def _draw_words(self, row: Listed, width: float, faint: bool) -> None:
        """Write the words of a row. faint: those beside its name, which need the usual ground for that."""
        em, left = imgui.get_font_size(), imgui.get_cursor_pos_x()
        beside = imgui.text_disabled if faint else imgui.text
        imgui.align_text_to_frame_padding()
        beside(_ICONS[row.kind])
        imgui.same_line(left + _ICON_ROOM * em)
        room = width - (_ICON_ROOM + _COUNT_ROOM) * em
        imgui.text(widgets.fitted(printable(row.title), room))
        imgui.same_line(left + width - _COUNT_ROOM * em)
        beside(f"{row.frames} frames" if row.frames > 1 else "")

    def _draw_foot(self) -> None:
        row = self._rows[self._chosen] if self._rows else None
        goes = row is not None and not row.frames
        texts = ("Go there" if goes else "Open", "Cancel")
        padding, gap = imgui.get_style().frame_padding.x, imgui.get_style().item_spacing.x
        room = sum(imgui.calc_text_size(text).x + 2 * padding for text in texts) + gap
        left = imgui.get_content_region_avail().x - room
        imgui.align_text_to_frame_padding()
        imgui.text_disabled(widgets.fitted(_HINT, left - gap))
        imgui.same_line(imgui.get_cursor_start_pos().x + left)
        imgui.begin_disabled(row is None)
        if imgui.button(texts[0]) and row is not None:
            self._take(row)
        imgui.end_disabled()
        imgui.same_line()
        if imgui.button(texts[1]):
            imgui.close_current_popup()


def _is_pressed(*keys: imgui.Key) -> bool:
    """Whether one of the keys was pressed just now; holding it down does not count."""
    return any(imgui.is_key_pressed(key, repeat=False) for key in keys)
