"""The windows of the Help menu: keys and mouse, messages, about. They float over the 3D view."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from imgui_bundle import ImVec2, imgui

from .. import __version__
from ..drawing.renderer import Renderer
from ..files import printable
from ..folders import user_folder
from . import widgets
from .commands import Command, Menu
from .keys import Keys
from .menus import Commands
from .notices import Notices
from .part import ViewArea, WindowPart

_PAGES = ("Keys and mouse", "Messages", "About")
_SIZE = ImVec2(60.0, 34.0)  # in heights of the font
_KEY_COLUMN = 12.0
_TWO_COLUMNS = 50.0  # least width of two columns
Section = tuple[str, Sequence[tuple[str, str]]]  # its title and rows


@dataclass(eq=False)
class Help(WindowPart):
    """Windows with all commands, all messages and what this is.

    open: the pages that are, the one opened last at the end. focused: the one of them that has the focus,
    None where none has.
    """

    name = "help"
    layer = 60
    shows = "Help"
    OFFERS = {"focused_page": "focused"}
    commands: Commands
    keys: Keys
    notices: Notices
    renderer: Renderer

    def __post_init__(self) -> None:
        self.open: list[str] = []
        self.focused: str | None = None
        self._searched = ""

    def toggle(self, page: str) -> None:
        """Open or close one of the pages."""
        assert page in _PAGES
        if page in self.open:
            self.open.remove(page)
        else:
            self.open.append(page)

    def enders(self) -> Iterable[tuple[int, Callable[[], bool]]]:
        """The page that has the focus; below what goes on in the view, the one that was opened last."""
        return (self.layer, self.on_escape), (25, self.close_last)

    def on_escape(self) -> bool:
        """Close the page that has the focus; whether one has."""
        focused, self.focused = self.focused, None
        if focused in self.open:
            self.open.remove(focused)
        return focused is not None

    def close_last(self) -> bool:
        """Close the page that was opened last; whether one was open."""
        return self.open.pop() is not None if self.open else False

    def dialog(self, view: ViewArea) -> None:
        """Declare the windows of the open pages."""
        self.focused = None
        pages = self._draw_keys, self._draw_messages, self._draw_about
        for page, draw_page in zip(_PAGES, pages, strict=True):
            if page not in self.open:
                continue
            em, display = imgui.get_font_size(), imgui.get_io().display_size
            size = ImVec2(min(_SIZE.x * em, 0.9 * display.x), min(_SIZE.y * em, 0.8 * display.y))
            imgui.set_next_window_size(size, imgui.Cond_.appearing)
            imgui.set_next_window_pos((display - size) * 0.5, imgui.Cond_.appearing)
            flags = imgui.WindowFlags_.no_collapse | imgui.WindowFlags_.no_saved_settings
            _, stays = imgui.begin(page, True, flags)
            if imgui.is_window_focused(imgui.FocusedFlags_.child_windows):
                self.focused = page
            is_ended = self.focused == page and imgui.is_key_pressed(imgui.Key.escape)  # in its field
            draw_page()
            imgui.end()
            if is_ended or not stays:
                self.toggle(page)

    def _draw_keys(self) -> None:
        """Declare the mouse, then every command in the order of the menus, in two columns where there is
        room; of all those that have the words that are searched for."""
        imgui.set_next_item_width(-1)
        if imgui.is_window_appearing():
            imgui.set_keyboard_focus_here()
        self._searched = imgui.input_text_with_hint("##search", "Search", self._searched)[1]
        sections = [("Mouse", [(does, how) for how, does in self.commands.mouse])]
        sections += [(menu.title, list(self._rows(menu))) for menu in self.commands.menus]
        words = self._searched.lower().split()
        found = [
            (title, [row for row in rows if has_words((title, *row), words)]) for title, rows in sections
        ]
        found = [(title, rows) for title, rows in found if rows]
        if not found:
            imgui.text_disabled("No match")
        room = imgui.get_content_region_avail().x / imgui.get_font_size()
        columns = 2 if room >= _TWO_COLUMNS and not words else 1
        if found and imgui.begin_table("commands", columns):
            for column in in_columns(found, columns):
                imgui.table_next_column()
                for title, rows in column:
                    imgui.separator_text(title)
                    for does, keys in rows:
                        _row(keys, does)
            imgui.end_table()

    def _rows(self, menu: Menu, path: str = "") -> Iterator[tuple[str, str]]:
        """The commands of a menu: what each does, and its keys."""
        for group in menu.groups:
            for entry in group:
                if isinstance(entry, Command):
                    yield path + entry.title, self.keys.of[entry.name] or "-"
                elif isinstance(entry, Menu):
                    yield from self._rows(entry, f"{path}{entry.title}: ")

    def _draw_messages(self) -> None:
        """Declare all messages, the latest first."""
        if not self.notices.all:
            imgui.text_disabled("No messages")
        elif imgui.button("Copy all"):
            lines = (f"{notice.at:%H:%M:%S}  {notice.text}" for notice in self.notices.all)
            imgui.set_clipboard_text("\n".join(lines))
        for notice in reversed(self.notices.all):
            imgui.text_disabled(f"{notice.at:%H:%M:%S}")
            imgui.same_line(5 * imgui.get_font_size())
            imgui.text_wrapped(notice.text)

    def _draw_about(self) -> None:
        gpu = self.renderer.gpu
        imgui.text_wrapped(f"Scan4D {__version__}: a viewer for 4D scans.")
        imgui.spacing()
        software = ", in software" if gpu.software else ""
        widgets.fact("Device", f"OpenGL {gpu.driver} on {gpu.device}{software}")
        widgets.fact("Licence", "MIT")
        widgets.fact("Settings", printable(str(user_folder())))
        imgui.spacing()
        if imgui.button("Copy"):
            imgui.set_clipboard_text(f"Scan4D {__version__}, OpenGL {gpu.driver} on {gpu.device}{software}")
        widgets.tooltip("Copy the version and the graphics device, for a bug report")

    COMMANDS = (
        Command("keys", "Keys and mouse", lambda help: help.toggle("Keys and mouse"), "F1"),
        Command("messages", "Messages", lambda help: help.toggle("Messages")),
        Command("about", "About", lambda help: help.toggle("About")),
    )


def has_words(texts: Iterable[str], words: Iterable[str]) -> bool:
    """Whether each of the words, lower case, is in one of the texts."""
    return all(any(word in text.lower() for text in texts) for word in words)


def in_columns(sections: Sequence[Section], count: int) -> list[list[Section]]:
    """Put sections of rows into so many columns of about one length, in order."""
    columns: list[list[Section]] = [[] for _ in range(count)]
    whole, before = sum(len(rows) + 1 for _, rows in sections), 0
    for title, rows in sections:
        columns[min((before + len(rows) // 2) * count // whole, count - 1)].append((title, rows))
        before += len(rows) + 1
    return columns


def _row(keys: str, does: str) -> None:
    """Declare keys and what they do beside each other, each in as many lines as it takes."""
    start, column = imgui.get_cursor_pos_x(), _KEY_COLUMN * imgui.get_font_size()
    imgui.begin_group()
    imgui.push_text_wrap_pos(start + column - imgui.get_style().item_spacing.x)
    imgui.text_disabled(keys)
    imgui.pop_text_wrap_pos()
    imgui.end_group()
    imgui.same_line()
    imgui.set_cursor_pos_x(start + column)
    imgui.text_wrapped(does)
