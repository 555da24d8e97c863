"""How the window is divided: menus, toolbar, the 3D view, a panel at its right, timeline and drawer below."""

from __future__ import annotations

from dataclasses import dataclass

from imgui_bundle import ImVec2, imgui

from . import escape
from .drawer import Drawer
from .failures import Failures
from .keyboard import NO_KEYS, Keyboard
from .menu import MenuBar
from .panel import Panel
from .part import Parts, ViewArea, WindowPart
from .playing.timeline_bar import TimelineBar
from .scene.full_view import FullView
from .scene.view import SceneView
from .shortcuts import Shortcuts
from .tasks import Tasks

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


@dataclass(eq=False)
class WindowLayout(WindowPart):
    """Declares all parts where they stand."""

    name = "layout"
    parts: Parts
    failures: Failures
    keyboard: Keyboard
    shortcuts: Shortcuts
    menu_bar: MenuBar
    view: SceneView
    side_panel: Panel
    timeline_bar: TimelineBar
    drawer: Drawer
    tasks: Tasks
    full_view: FullView

    def draw(self) -> ViewArea:
        """Declare all widgets; returns where the 3D view is. Where a part fails, the others are there."""
        reported = self.failures.reported
        self.keyboard.begin_frame()
        self.shortcuts.handle()
        with reported("Escape"):
            enders = [ender for part in self.parts for ender in part.enders()]
            escape.handle(end for _, end in sorted(enders, key=lambda ender: -ender[0]))
        view = self._draw_view_alone() if self.full_view.is_on else self._draw_parts()
        for part in sorted(self.parts, key=lambda part: part.layer):
            with reported(part.shows):
                part.dialog(view)
        return view

    def _draw_view_alone(self) -> ViewArea:
        whole = imgui.get_io().display_size
        view = self._draw_view(0, int(whole.x), int(whole.y))
        with self.failures.reported("The list of running tasks"):
            self.tasks.draw_alone(view)
        return view

    def _draw_parts(self) -> ViewArea:
        whole = imgui.get_io().display_size
        top = 0
        with self.failures.reported("The menu"):
            top = self._draw_head(whole.x)
        em = imgui.get_font_size()
        # Whole numbers, so that the picture's edges fall on pixels.
        width = max(1, int(whole.x - min(self.side_panel.width * em, 0.5 * whole.x)))
        grip = int(_GRIP * em)
        bar = min(_BAR_HEIGHT * em, 0.5 * whole.y)
        drawer = drawer_height(grip + self.drawer.shown_height * em, whole.y, whole.y - top - bar)
        below = whole.y - drawer if self.drawer.is_open else whole.y
        bottom = int(below - bar)
        height = max(1, bottom - top)
        view = self._draw_view(top, width, height)
        with self.failures.reported("The panel"):
            _begin_grip("grip", width, top, grip, height)
            self.side_panel.draw_grip(height)
            imgui.end()
            _begin_window("panel", width + grip, top, whole.x - width - grip, height)
            self.side_panel.draw()
            imgui.end()
        with self.failures.reported("The timeline"):
            _begin_window("timeline", 0, bottom, whole.x, below - bottom, self.keyboard.flags("timeline"))
            self.keyboard.take("timeline")
            self.timeline_bar.draw()
            imgui.end()
        if below < whole.y:
            with self.failures.reported("The area under the timeline"):
                _begin_grip("grip below", 0, below, whole.x, grip)
                self.drawer.draw_grip(whole.x)
                imgui.end()
                _begin_window("drawer", 0, below + grip, whole.x, whole.y - below - grip)
                self.drawer.draw()
                imgui.end()
        return view

    def _draw_view(self, top: int, width: int, height: int) -> ViewArea:
        """Declare the view; returns where it is."""
        with self.failures.reported("The view"):
            imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0, 0))
            _begin_window("view", 0, top, width, height)
            imgui.pop_style_var()
            self.view.draw()
            imgui.end()
        return 0, top, width, height

    def _draw_head(self, width: float) -> int:
        """Declare menus and toolbar; returns where what is below them begins."""
        below = self.menu_bar.draw()
        padding = imgui.get_style().window_padding
        padding = ImVec2(padding.x, 0.4 * padding.y)  # not the style's own, which the next line changes
        imgui.push_style_var(imgui.StyleVar_.window_padding, padding)
        height = imgui.get_frame_height() + 2 * padding.y
        _begin_window("toolbar", 0, below, width, height)
        self.menu_bar.draw_toolbar()
        imgui.end()
        imgui.pop_style_var()
        return int(below + height)


def drawer_height(wanted: float, window: float, room: float) -> float:
    """The height of the drawer, which leaves enough of the window to the view. wanted: by the user's choice.
    room: for both. All in pixels."""
    room = max(room, 0.0)
    return min(wanted, room - min(_VIEW_SHARE * window, _VIEW_PART * room))


def _begin_grip(name: str, left: float, top: float, width: float, height: float) -> None:
    """Begin an ImGui window that is nothing but a grip."""
    imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0, 0))
    imgui.push_style_var(imgui.StyleVar_.window_min_size, ImVec2(1, 1))
    _begin_window(name, left, top, width, height)
    imgui.pop_style_var(2)


def _begin_window(
    name: str, left: float, top: float, width: float, height: float, keys: int = NO_KEYS
) -> None:
    """Begin an ImGui window. keys: flags that say whether the keyboard goes through its widgets."""
    imgui.set_next_window_pos(ImVec2(left, top))
    imgui.set_next_window_size(ImVec2(width, height))
    imgui.push_style_var(imgui.StyleVar_.window_border_size, 0.0)
    imgui.push_style_var(imgui.StyleVar_.window_rounding, 0.0)
    imgui.begin(name, flags=_STILL.value | keys)
    imgui.pop_style_var(2)
