"""The dialog that finds a scan: a folder's scans, and those opened lately."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ...document.recording import is_recording
from ...document.saved_session import SUFFIX, is_session
from ...files import printable
from ...scan.listing import Listed, list_folder
from ...scan.open import DEMO, is_no_path
from ...scan.timeline import Timeline
from .. import widgets
from ..commands import Command
from ..file_dialog import files_of
from ..notices import Offer
from ..part import ViewArea, WindowPart
from ..session import Session, known_as
from ..window import Window
from .folder_view import FolderView, date_in_words, size_in_words
from .opener import Opener
from .preview import Previewer
from .scans import Scans, title
from .sessions import Sessions

_TITLE = "Open a scan"
_SIZE = ImVec2(72.0, 36.0)  # in heights of the font
_KNOWN_SHARE, _PREVIEW_SHARE = 0.2, 0.26  # of the width
_KNOWN_LEAST = 9.5  # the same of the known folders, in heights of the font
_LINGERS = 0.15  # seconds that a row is chosen before its scan is read
_HINT = "You can also drop files, folders and recordings onto the window."


def _list(folder: Path) -> list[Listed]:
    """The scans and folders in a folder, then its session files. Raises InputError where it cannot be listed,
    OSError where a session file cannot be read."""
    scans = list_folder(folder)
    return [*scans, *(file for file in files_of(folder, (SUFFIX,)) if file.kind == "file")]


@dataclass(eq=False)
class Browser(WindowPart):
    """The folder that the dialog shows, and what is chosen in it. A folder is listed beside the window.

    It stays open until what was chosen is open, and tells why that cannot be.

    is_open: whether the dialog is.
    """

    name = "browser"
    doing = "Listing a folder"
    layer = 80
    shows = "The dialog that opens scans"
    OFFERS = {"ask_for_scan": "show", "close_browser": "opened"}
    session: Session
    scans: Scans
    sessions: Sessions
    opener: Opener
    open_scan: Callable[[str], None]
    replay: Callable[[Path], None]
    take_file: Callable[[Path], bool]
    window: Window

    def __post_init__(self) -> None:
        self._previewer = Previewer(self.window.ctx)
        self._asked = False  # to be opened
        self.is_open = self._is_done = False
        self._asks_for: str | None = None  # what is being opened
        self._solutions: dict[str, Callable[[], object]] = {}  # buttons below the refusal
        self._view = FolderView(
            _list, self._open, nothing="No scans or sessions in this folder.", filters=True
        )

    @property
    def refusal(self) -> str:
        """Why what was chosen could not be opened, in words."""
        return self._view.refusal

    def show(self, folder: Path | None = None) -> None:
        """Open the dialog on a folder; None: that of the open scan, that scan chosen."""
        self._asked, self._asks_for = True, None
        if folder is not None:
            self._view.show(folder)
            return
        scan = self.session.scan
        here = self._view.folder if is_no_path(scan) else Path(known_as(scan)).parent
        self._view.show(here, "" if is_no_path(scan) else known_as(scan))

    @property
    def waits(self) -> bool:
        """Whether a folder is being listed, or a preview drawn."""
        lingers = self.is_open and time.monotonic() - self._view.chosen_at < 2 * _LINGERS
        return self._view.waits or self._previewer.waits or lingers

    def opened(self) -> None:
        """Take in that a scan was opened: the dialog closes where it waited for one."""
        self._is_done = self._asks_for is not None
        self._asks_for = None

    def refused(self, problem: str) -> bool:
        """Take in why nothing was opened; whether the dialog waited for that, and tells it."""
        if self._asks_for is None:
            return False
        self._asks_for, self._view.refusal = None, problem
        self._solutions = dict(problem.choices) if isinstance(problem, Offer) else {}
        return True

    def begin_scan(self, timeline: Timeline) -> None:
        """Close the dialog where it waited for a scan."""
        self.opened()

    def advance(self, now: float) -> bool:
        """Take in the folder's list and the preview; whether anything has come."""
        changed = self._previewer.advance()
        if self.is_open and time.monotonic() - self._view.chosen_at > _LINGERS:
            row = self._view.row
            has_picture = row is not None and row.frames and not is_session(Path(row.path))
            self._previewer.ask(row.path if row is not None and has_picture else None)
        return self._view.advance() or changed

    def dialog(self, view: ViewArea) -> None:
        """Declare the dialog where it is open."""
        if self._asked:
            imgui.open_popup(_TITLE)
            self._asked, self._is_done, self._view.refusal = False, False, ""
        em, display = imgui.get_font_size(), imgui.get_io().display_size
        size = ImVec2(min(_SIZE.x * em, 0.94 * display.x), min(_SIZE.y * em, 0.9 * display.y))
        imgui.set_next_window_size(size, imgui.Cond_.always)
        imgui.set_next_window_pos(display * 0.5, imgui.Cond_.appearing, ImVec2(0.5, 0.5))
        flags = imgui.WindowFlags_.no_saved_settings | imgui.WindowFlags_.no_resize
        is_open, stays = imgui.begin_popup_modal(_TITLE, True, flags)
        self.is_open = is_open
        if is_open:
            self._draw_inside()
            if not stays or imgui.is_key_pressed(imgui.Key.escape):
                self._give_up()
            if self._is_done:
                imgui.close_current_popup()
                self._is_done = False
            imgui.end_popup()
        elif not self._asked:
            self.sessions.take_located, self._asks_for = None, None  # the user gave up
            self._previewer.ask(None)

    # --- what the user does -----------------------------------------------------------

    def _give_up(self) -> None:
        """Close the dialog; what it waits for is not opened."""
        if self._asks_for is not None:
            self.opener.job.cancel()
        imgui.close_current_popup()

    def _open(self, scan: str) -> None:
        self._asks_for, self._view.refusal = scan, ""
        if is_session(Path(scan)):
            self.sessions.open(Path(scan))
        elif (take := self.sessions.take_located) is not None:
            take(scan)
        elif is_recording(Path(scan)):
            self.replay(Path(scan))
            self.opened()
        elif self.take_file(Path(scan)):
            self.opened()
        else:
            self.scans.open([scan])

    # --- widgets ----------------------------------------------------------------------

    def _draw_inside(self) -> None:
        self._view.take_keys()  # before the field for the path lets go of them
        self._view.draw_path()
        self._view.draw_refusal()
        self._draw_solutions()
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
        self._view.draw_rows()
        imgui.end_child()
        imgui.end_child()
        imgui.same_line()
        imgui.begin_child("preview", ImVec2(0, -foot))
        self._draw_preview()
        imgui.end_child()
        self._draw_foot()

    def _draw_solutions(self) -> None:
        """Declare the buttons that help with what was refused; they close the dialog."""
        for name, act in self._solutions.items() if self._view.refusal else ():
            if imgui.button(name):
                imgui.close_current_popup()
                act()

    def _draw_filter(self) -> None:
        imgui.set_next_item_width(-1)
        changed, text = imgui.input_text_with_hint("##filter", "Filter by name", self._view.filter)
        if changed:
            self._view.narrow(text)

    def _draw_preview(self) -> None:
        self._previewer.draw_picture()
        if (row := self._view.row) is not None:
            imgui.text_wrapped(printable(row.title))
            words = "Session" if is_session(Path(row.path)) else printable(self._previewer.words)
            imgui.text_wrapped(words)
            shown = [size_in_words(row.size), date_in_words(row.changed, "%Y-%m-%d %H:%M")]
            widgets.faint(", ".join(filter(None, shown)))

    def _draw_known(self) -> None:
        """Declare the folders to look in, and the lists of what can be opened at once, wherever it is."""
        self._view.draw_known_folders()
        is_open = self.session.scan == DEMO
        if imgui.selectable(f"{icons.ICON_FA_CUBE}  Demo scan###Demo scan", is_open)[0]:
            self._open_known(DEMO)
        imgui.spacing()
        scans = self.scans
        if scans.are_together:
            self._draw_names("Opened together", scans.listed)
            imgui.spacing()
        self._draw_names("Recent", scans.lately)

    def _draw_names(self, head: str, scans: Sequence[str]) -> None:
        imgui.text_disabled(head)
        imgui.push_id(head)
        for number, scan in enumerate(scans):
            name = widgets.fitted(title(scan), imgui.get_content_region_avail().x)
            is_open = known_as(scan) == known_as(self.session.scan)
            if imgui.selectable(widgets.labelled(name, number), is_open)[0]:
                self._open_known(scan)
            widgets.tooltip(printable(scan))
        if not scans:
            imgui.text("none")
        imgui.pop_id()

    def _open_known(self, scan: str) -> None:
        self._asks_for, self._view.refusal = scan, ""
        self.open_scan(scan)

    def _draw_foot(self) -> None:
        row = self._view.row
        goes = row is not None and not row.frames
        texts = ("Go" if goes else "Open", "Cancel")
        padding, gap = imgui.get_style().frame_padding.x, imgui.get_style().item_spacing.x
        room = sum(imgui.calc_text_size(text).x + 2 * padding for text in texts) + gap
        left = imgui.get_content_region_avail().x - room
        imgui.align_text_to_frame_padding()
        waits = self._asks_for is not None
        shown = f"Opening {printable(title(self._asks_for))} ..." if self._asks_for is not None else _HINT
        imgui.text_disabled(widgets.fitted(shown, left - gap))
        imgui.same_line(imgui.get_cursor_start_pos().x + left)
        imgui.begin_disabled(row is None or waits)
        if imgui.button(texts[0]) and row is not None:
            self._view.take(row)
        imgui.end_disabled()
        imgui.same_line()
        if imgui.button(texts[1]):
            self._give_up()

    COMMANDS = (
        Command(
            "open", "Open a scan...", lambda browser: browser.show(), "Ctrl+O Q", short="Open",
            icon=icons.ICON_FA_FOLDER_OPEN,
        ),
    )  # fmt: skip
