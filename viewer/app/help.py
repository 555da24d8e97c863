"""The windows of the Help menu: keys and mouse, messages, about. They float over the 3D view."""

from __future__ import annotations

from typing import Any

from imgui_bundle import ImVec2, imgui

from .. import __version__
from ..gpu.context import Gpu
from .commands import Command, Commands, Menu
from .keys import Keys
from .notices import Notices

_PAGES = ("Keys and mouse", "Messages", "About")
_SIZE = ImVec2(44.0, 30.0)  # in heights of the font
_KEY_COLUMN = 15.0


class Help:
    """Windows with all commands, all messages and what this is.

    open: the pages that are. focused: the one of them that has the focus, None where none has.
    """

    def __init__(self, commands: Commands, keys: Keys, notices: Notices, gpu: Gpu) -> None:
        self._commands, self._keys, self._notices, self._gpu = commands, keys, notices, gpu
        self.open: set[str] = set()
        self.focused: str | None = None

    def toggle(self, page: str) -> None:
        """Open or close one of the pages."""
        assert page in _PAGES
        self.open ^= {page}

    def on_escape(self) -> bool:
        """Close the page that has the focus; whether one has."""
        self.open.discard(self.focused or "")
        return self.focused is not None

    def draw(self) -> None:
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
            if imgui.is_window_focused():
                self.focused = page
            draw_page()
            imgui.end()
            if not stays:
                self.toggle(page)

    def _draw_keys(self) -> None:
        """Declare the mouse, then every command in the order of the menus."""
        imgui.separator_text("Mouse")
        for name, does in self._commands.mouse:
            _row(name, does)
        for menu in self._commands.menus:
            imgui.separator_text(menu.title)
            self._draw_commands(menu)

    def _draw_commands(self, menu: Menu[Any], path: str = "") -> None:
        for group in menu.groups:
            for entry in group:
                if isinstance(entry, Command):
                    _row(self._keys.of[entry.name] or "-", path + entry.title)
                elif isinstance(entry, Menu):
                    self._draw_commands(entry, f"{path}{entry.title}: ")

    def _draw_messages(self) -> None:
        """Declare all messages, the latest first."""
        if not self._notices.all:
            imgui.text_disabled("There are none.")
        elif imgui.button("Copy all"):
            lines = (f"{notice.at:%H:%M:%S}  {notice.text}" for notice in self._notices.all)
            imgui.set_clipboard_text("\n".join(lines))
        for notice in reversed(self._notices.all):
            imgui.text_disabled(f"{notice.at:%H:%M:%S}")
            imgui.same_line(5 * imgui.get_font_size())
            imgui.text_wrapped(notice.text)

    def _draw_about(self) -> None:
        gpu = self._gpu
        imgui.text_wrapped(f"Scan4D {__version__}: a viewer for 4D scans.")
        imgui.spacing()
        software = ", in software" if gpu.software else ""
        imgui.text_wrapped(f"OpenGL {gpu.driver} on {gpu.device}{software}")
        imgui.text_wrapped(f"{len(self._commands.of)} commands. {self._keys.hint('keys')}: all their keys.")


def _row(name: str, does: str) -> None:
    imgui.text_disabled(name)
    imgui.same_line(_KEY_COLUMN * imgui.get_font_size())
    imgui.text_wrapped(does)
