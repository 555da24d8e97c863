"""The windows of the Help menu: keys and mouse, messages, about. They float over the 3D view."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import ImVec2, imgui

from .. import __version__
from .commands import Command, Menu

if TYPE_CHECKING:
    from .app import App

_PAGES = ("Keys and mouse", "Messages", "About")
_SIZE = ImVec2(44.0, 30.0)  # in heights of the font
_KEY_COLUMN = 15.0


class Help:
    """open: the pages that are. focused: the one of them that has the focus, None where none has."""

    def __init__(self) -> None:
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


def draw(app: App) -> None:
    """Declare the windows of the open pages."""
    app.help.focused = None
    for page, draw_page in zip(_PAGES, (_draw_keys, _draw_messages, _draw_about), strict=True):
        if page not in app.help.open:
            continue
        em, display = imgui.get_font_size(), imgui.get_io().display_size
        size = ImVec2(min(_SIZE.x * em, 0.9 * display.x), min(_SIZE.y * em, 0.8 * display.y))
        imgui.set_next_window_size(size, imgui.Cond_.appearing)
        imgui.set_next_window_pos((display - size) * 0.5, imgui.Cond_.appearing)
        flags = imgui.WindowFlags_.no_collapse | imgui.WindowFlags_.no_saved_settings
        _, stays = imgui.begin(page, True, flags)
        if imgui.is_window_focused():
            app.help.focused = page
        draw_page(app)
        imgui.end()
        if not stays:
            app.help.toggle(page)


def _draw_keys(app: App) -> None:
    """The mouse, then every command in the order of the menus."""
    imgui.separator_text("Mouse")
    for name, does in app.commands.mouse:
        _row(name, does)
    for menu in app.commands.menus:
        imgui.separator_text(menu.title)
        _draw_commands(app, menu)


def _draw_commands(app: App, menu: Menu[App], path: str = "") -> None:
    for group in menu.groups:
        for entry in group:
            if isinstance(entry, Command):
                _row(app.keys.of[entry.name] or "-", path + entry.title)
            elif isinstance(entry, Menu):
                _draw_commands(app, entry, f"{path}{entry.title}: ")


def _row(name: str, does: str) -> None:
    imgui.text_disabled(name)
    imgui.same_line(_KEY_COLUMN * imgui.get_font_size())
    imgui.text_wrapped(does)


def _draw_messages(app: App) -> None:
    """All of them, the latest first."""
    if not app.notices.all:
        imgui.text_disabled("There are none.")
    elif imgui.button("Copy all"):
        lines = (f"{notice.at:%H:%M:%S}  {notice.text}" for notice in app.notices.all)
        imgui.set_clipboard_text("\n".join(lines))
    for notice in reversed(app.notices.all):
        imgui.text_disabled(f"{notice.at:%H:%M:%S}")
        imgui.same_line(5 * imgui.get_font_size())
        imgui.text_wrapped(notice.text)


def _draw_about(app: App) -> None:
    gpu = app.renderer.gpu
    imgui.text_wrapped(f"Scan4D {__version__}: a viewer for 4D scans.")
    imgui.spacing()
    imgui.text_wrapped(f"OpenGL {gpu.driver} on {gpu.device}" + (", in software" if gpu.software else ""))
    imgui.text_wrapped(f"{len(app.commands.of)} commands. {app.keys.hint('keys')}: all their keys.")
