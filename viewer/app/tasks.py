"""What takes a while, over the picture: its name, how far it is, and a button that cancels it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import ImVec2, imgui

from ..task import Task
from . import widgets

if TYPE_CHECKING:
    from .app import App

_PATIENCE = 0.3  # seconds that work may take before it is shown
_WIDTH = 28.0  # in heights of the font
_TICK = 0.1  # seconds between changes of what is shown
_FLAGS = (
    imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_focus_on_appearing
)  # fmt: skip


def shown(app: App) -> list[Task]:
    """The work to show, the latest last."""
    return [task for task in app.tasks if task.seconds > _PATIENCE]


def report(app: App) -> list[tuple[str, int]]:
    """Changes when something else is to be shown."""
    return [(task.name, int(task.seconds / _TICK)) for task in shown(app)]


def draw(app: App, place: tuple[float, float, float, float], head: float) -> None:
    """Declare the work over the top of the 3D view.

    place: of the view: left, top, width, height. head: how much of its top is taken by notes.
    """
    tasks = shown(app)
    if not tasks:
        return
    left, top, width, _ = place
    em = imgui.get_font_size()
    own_width = min(_WIDTH * em, 0.9 * width)
    imgui.set_next_window_pos(ImVec2(left + (width - own_width) / 2, top + head + em))
    imgui.set_next_window_size_constraints(ImVec2(own_width, 0), ImVec2(own_width, 1e4))
    imgui.begin("tasks", flags=_FLAGS)
    for task in tasks:
        _draw_task(app, task)
    imgui.end()


def end_by_escape(app: App) -> list[Task]:
    """The work shown that Escape cancels: not what may have taken long, since it is pressed for other reasons
    too."""
    return [task for task in shown(app) if task is not app.exporting.task]


def on_escape(app: App) -> bool:
    """Cancel the latest work that Escape cancels; whether there is any."""
    lightly = end_by_escape(app)
    if lightly:
        app.cancel(lightly[-1])
    return bool(lightly)


def _draw_task(app: App, task: Task) -> None:
    gap = imgui.get_style().item_spacing.x
    width = imgui.get_content_region_avail().x
    imgui.text_unformatted(widgets.shortened(task.name, width))
    button = imgui.calc_text_size("Cancel").x + 2 * imgui.get_style().frame_padding.x
    size = ImVec2(width - button - gap, imgui.get_frame_height())
    words = f"{task.seconds:.0f} s"
    if task.progress is None:
        imgui.progress_bar(-task.seconds, size, words)  # a negative share: it only moves
    else:
        imgui.progress_bar(task.progress, size, f"{100 * task.progress:.0f} %, {words}")
    imgui.same_line()
    if imgui.button(f"Cancel##{id(task)}"):
        app.cancel(task)
    imgui.set_item_tooltip("Cancel (Esc)" if task in end_by_escape(app) else "Cancel")
