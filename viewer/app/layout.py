"""How the window is divided: the 3D view, a panel at its right, the timeline below."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import ImVec2, imgui

from . import keys, panel, timeline_bar, view

if TYPE_CHECKING:
    from .app import App

_PANEL_WIDTH = 21.0  # in heights of the font
_BAR_HEIGHT = 6.2
# No background: the window is filled with the panels' colour before.
_STILL = (
    imgui.WindowFlags_.no_title_bar | imgui.WindowFlags_.no_resize | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_saved_settings | imgui.WindowFlags_.no_bring_to_front_on_focus
    | imgui.WindowFlags_.no_scrollbar | imgui.WindowFlags_.no_scroll_with_mouse
    | imgui.WindowFlags_.no_nav | imgui.WindowFlags_.no_background
)  # fmt: skip


def draw(app: App) -> tuple[float, float, float, float]:
    """Declare all widgets; returns the 3D view: left, top, width, height in ImGui's coordinates."""
    keys.handle(app)
    whole = imgui.get_io().display_size
    em = imgui.get_font_size()
    # Whole numbers, so that the picture's edges fall on pixels.
    width = max(1, int(whole.x - min(_PANEL_WIDTH * em, 0.5 * whole.x)))
    height = max(1, int(whole.y - min(_BAR_HEIGHT * em, 0.5 * whole.y)))
    imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0, 0))
    _place("view", 0, 0, width, height)
    imgui.pop_style_var()
    view.draw(app)
    imgui.end()
    _place("panel", width, 0, whole.x - width, height)
    panel.draw(app)
    imgui.end()
    _place("timeline", 0, height, whole.x, whole.y - height)
    timeline_bar.draw(app)
    view.draw_pointed(app)
    imgui.end()
    return 0, 0, width, height


def _place(name: str, left: float, top: float, width: float, height: float) -> None:
    imgui.set_next_window_pos(ImVec2(left, top))
    imgui.set_next_window_size(ImVec2(width, height))
    imgui.begin(name, flags=_STILL)
