"""How the window is divided: menus, toolbar, the 3D view, a panel at its right, timeline and drawer below."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import ImVec2, imgui

from . import escape, menu
from .keyboard import NO_KEYS
from .output import export_dialog
from .playing import timeline_bar
from .scene import view
from .ui import Ui

if TYPE_CHECKING:
    from .app import App

Place = tuple[float, float, float, float]  # left, top, width, height in ImGui's coordinates
_GRIP = 0.4  # width of what resizes the panel and the drawer, in heights of the font
_BAR_HEIGHT = 4.8
# The least height of the view, in shares of the window, and of what it and the drawer have together:
_VIEW_SHARE, _VIEW_PART = 0.35, 0.6
# No background: the window is filled with the panels' colour before.
_STILL = (
    imgui.WindowFlags_.no_title_bar | imgui.WindowFlags_.no_resize | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_saved_settings | imgui.WindowFlags_.no_bring_to_front_on_focus
    | imgui.WindowFlags_.no_scrollbar | imgui.WindowFlags_.no_scroll_with_mouse
    | imgui.WindowFlags_.no_nav_focus | imgui.WindowFlags_.no_background
)  # fmt: skip


def draw(app: App) -> Place:
    """Declare all widgets; returns where the 3D view is. Where a part fails, the others are there."""
    told = app.failures.told
    app.keyboard.begin_frame()
    app.keys.handle(app)
    with told("Escape"):
        escape.handle((
            app.welcome.on_escape, app.help.on_escape, app.keyboard.on_escape, app.tools.on_escape,
            app.replayer.on_escape, app.help.close_last, app.notices.on_escape, app.tasks.on_escape,
            app.full_view.on_escape,
        ))  # fmt: skip
    place = _draw_view_alone(app) if app.full_view.is_on else _draw_parts(app)
    for name, draw_part in (
        ("Messages that stay", lambda: app.notices.draw_staying(*place, app.palette.broken, app.keyboard)),
        ("What is loaded", lambda: app.loading.draw(place, app.tasks.cancel)),
        ("Help", app.help.draw),
        ("The first card", lambda: app.welcome.draw(*place[:3])),
        ("The dialog that opens scans", app.browser.draw),
        ("The dialog that saves sessions", app.sessions.saving.draw),
        ("The export dialog", lambda: export_dialog.draw(app.exporting, app.quit)),
        ("Dialogs of tools", app.tools.draw_dialogs),
    ):
        with told(name):
            draw_part()
    return place


def _draw_view_alone(app: App) -> Place:
    whole = imgui.get_io().display_size
    place = _draw_view(app, 0, int(whole.x), int(whole.y))
    with app.failures.told("The list of work"):
        app.tasks.draw_alone(place)
    return place


def _draw_parts(app: App) -> Place:
    whole = imgui.get_io().display_size
    top = 0
    with app.failures.told("The menu"):
        top = _draw_head(app, whole.x)
    em = imgui.get_font_size()
    # Whole numbers, so that the picture's edges fall on pixels.
    width = max(1, int(whole.x - min(app.panel.width * em, 0.5 * whole.x)))
    grip = int(_GRIP * em)
    bar = min(_BAR_HEIGHT * em, 0.5 * whole.y)
    drawer = drawer_height(grip + app.drawer.shown_height * em, whole.y, whole.y - top - bar)
    below = whole.y - drawer if app.drawer.is_open else whole.y
    bottom = int(below - bar)
    height = max(1, bottom - top)
    place = _draw_view(app, top, width, height)
    with app.failures.told("The panel"):
        _place_grip("grip", width, top, grip, height)
        app.panel.draw_grip(height)
        imgui.end()
        _place("panel", width + grip, top, whole.x - width - grip, height)
        app.panel.draw(app)
        imgui.end()
    with app.failures.told("The timeline"):
        _place("timeline", 0, bottom, whole.x, below - bottom, app.keyboard.flags("timeline"))
        app.keyboard.take("timeline")
        timeline_bar.draw(app)
        imgui.end()
    if below < whole.y:
        with app.failures.told("What is under the timeline"):
            _place_grip("grip below", 0, below, whole.x, grip)
            app.drawer.draw_grip(whole.x)
            imgui.end()
            _place("drawer", 0, below + grip, whole.x, whole.y - below - grip)
            app.drawer.draw(app.keyboard, Ui(app.keys))
            imgui.end()
    return place


def drawer_height(wanted: float, window: float, room: float) -> float:
    """The height of the drawer, which leaves enough of the window to the view. wanted: by the user's choice.
    room: for both. All in pixels."""
    room = max(room, 0.0)
    return min(wanted, room - min(_VIEW_SHARE * window, _VIEW_PART * room))


def _draw_view(app: App, top: int, width: int, height: int) -> Place:
    """Declare the view; returns where it is."""
    with app.failures.told("The view"):
        imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0, 0))
        _place("view", 0, top, width, height)
        imgui.pop_style_var()
        view.draw(app)
        imgui.end()
    return 0, top, width, height


def _draw_head(app: App, width: float) -> int:
    """Declare menus and toolbar; returns where what is below them begins."""
    below = app.menu_bar.draw(app)
    padding = imgui.get_style().window_padding
    padding = ImVec2(padding.x, 0.4 * padding.y)  # not the style's own, which the next line changes
    imgui.push_style_var(imgui.StyleVar_.window_padding, padding)
    height = imgui.get_frame_height() + 2 * padding.y
    _place("toolbar", 0, below, width, height)
    menu.draw_toolbar(app)
    imgui.end()
    imgui.pop_style_var()
    return int(below + height)


def _place_grip(name: str, left: float, top: float, width: float, height: float) -> None:
    """Begin an ImGui window that is nothing but a grip."""
    imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0, 0))
    imgui.push_style_var(imgui.StyleVar_.window_min_size, ImVec2(1, 1))
    _place(name, left, top, width, height)
    imgui.pop_style_var(2)


def _place(name: str, left: float, top: float, width: float, height: float, keys: int = NO_KEYS) -> None:
    """Begin an ImGui window. keys: flags that say whether the keyboard goes through its widgets."""
    imgui.set_next_window_pos(ImVec2(left, top))
    imgui.set_next_window_size(ImVec2(width, height))
    imgui.push_style_var(imgui.StyleVar_.window_border_size, 0.0)
    imgui.push_style_var(imgui.StyleVar_.window_rounding, 0.0)
    imgui.begin(name, flags=_STILL.value | keys)
    imgui.pop_style_var(2)
