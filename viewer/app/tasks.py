"""Work that takes a while, in the status bar: its name, how far it is, and a button that cancels it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ..task import Task
from . import widgets
from .files.opener import Opener
from .output.capture import Capture
from .output.exporting import Exporting
from .part import ViewArea, WindowPart
from .playing.playback import Playback
from .scene.viewport import Viewport
from .session import Session
from .toolbox import Toolbox

_PATIENCE = 0.3  # seconds that work may take before it is shown,
_PLAYING_PATIENCE = 2.0  # and on a pose while others are shown
_WIDTH = 20.0  # of a bar in the list, in heights of the font
_LINE = 0.12  # height of the line that shows how far work is, in heights of the font
_TICK = 0.1  # seconds between changes of what is shown


@dataclass(eq=False)
class Tasks(WindowPart):
    """All work that goes on beside the window."""

    name = "tasks"
    layer = 10
    doing = "Updating the list of tasks"
    turn = 5
    OFFERS = {"cancel_task": "cancel"}
    session: Session
    playback: Playback
    viewport: Viewport
    opener: Opener
    tools: Toolbox
    exporting: Exporting
    capture: Capture
    note: Callable[[str], None]

    def __post_init__(self) -> None:
        self._report: list[tuple[str, int]] = []
        self._corner = ImVec2(0, 0)  # lower left one of the list

    @property
    def all(self) -> list[Task]:
        """All of the work, the latest last."""
        preparing = self.viewport.renderer.work.preparing
        tasks = [self.exporting.task, self.capture.task, preparing, self.opener.job.task, *self.tools.tasks]
        if self.playback.pose is None:
            tasks.append(self.playback.timeline.loading)
        return [task for task in tasks if task is not None]

    @property
    def shown(self) -> list[Task]:
        """The work to show, the latest last."""
        patience = {self.viewport.renderer.work.preparing: _PLAYING_PATIENCE} if self._is_playing else {}
        return [task for task in self.all if task.seconds > patience.get(task, _PATIENCE)]

    @property
    def _is_playing(self) -> bool:
        return self.playback.player.playing

    def advance(self, now: float) -> bool:
        """Whether something else is to be shown."""
        before = self._report
        self._report = [(task.name, int(task.seconds / _TICK)) for task in self.shown]
        return self._report != before

    @property
    def waits(self) -> bool:
        """Whether any work goes on."""
        return bool(self.all)

    def on_escape(self) -> bool:
        """Cancel opening a scan, which stands over the view; whether one is being opened. Work in the status
        bar goes on: whoever presses Escape means something else."""
        task = self.opener.job.task
        if task is None or task not in self.shown:
            return False
        self.cancel(task)
        return True

    def cancel(self, task: Task) -> None:
        """Stop a piece of the work; what was shown before it stays."""
        is_reported = task is self.playback.timeline.loading  # by what the timeline says of the frame
        if task is self.opener.job.task:
            self.opener.job.cancel()
        elif task is self.viewport.renderer.work.preparing:
            self._choose_prepared()
        task.cancel()
        if not is_reported:
            self.note(f"Cancelled: {task.name}.")

    def _choose_prepared(self) -> None:
        """Go back to what was drawn before, or to plain points."""
        if self.viewport.request is not None:
            drawn, chosen = self.viewport.request.look, self.session.document.look
            pose = self.playback.timeline.ready(self.session.index) or self.viewport.request.pose
            request = self.viewport.without_preparing(replace(self.viewport.request, pose=pose))
            look = request.look
            if look.color_by == drawn.color_by:  # which may stand for a scalar that the frame lacks
                look = replace(look, color_by=chosen.color_by)
            before = replace(self.session.document.drawn_by(str(request.backend)), look=look)
            self.session.history.change("Cancel preparing", before)

    def draw_alone(self, view: ViewArea) -> None:
        """Declare the work in a corner of the 3D view, where there is no status bar."""
        if not self.shown:
            return
        left, top, width, height = view
        corner = ImVec2(left + width, top + height) - imgui.get_style().window_padding
        imgui.set_next_window_pos(corner, imgui.Cond_.always, ImVec2(1, 1))
        imgui.begin("work", flags=widgets.FLOATING)
        self.draw(0.5 * width)
        imgui.end()

    def draw(self, width: float) -> None:
        """Declare the latest work in a line of at most this width; nothing while there is no work.

        A click on it shows all work in a list, the cross cancels it.
        """
        tasks = self.shown
        if tasks:
            self._draw_latest(tasks, width)
        imgui.set_next_window_pos(self._corner, imgui.Cond_.always, ImVec2(0, 1))
        if imgui.begin_popup("list of work"):
            for task in tasks:
                self._draw_task(task)
            if not tasks:
                imgui.close_current_popup()
            imgui.end_popup()

    def _draw_latest(self, tasks: list[Task], width: float) -> None:
        task, padding = tasks[-1], imgui.get_style().frame_padding.x
        others = f", {len(tasks) - 1} more" if len(tasks) > 1 else ""
        cross = imgui.calc_text_size(icons.ICON_FA_XMARK).x + 4 * padding
        end = f"  {widgets.how_far(task)}{others}"
        room = width - imgui.calc_text_size(end).x - cross - 2 * padding
        if imgui.small_button(widgets.labelled(widgets.fitted(task.name, room) + end, "work")):
            imgui.open_popup("list of work")
        widgets.tooltip(f"{task.name}. Click to see all running tasks")
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        line = ImVec2(low.x, high.y - _LINE * imgui.get_font_size())
        full = high.x - low.x
        if task.progress is None:  # a part of the line that goes round
            start = low.x + full * (0.5 * task.seconds % 1.0)
            line, high = ImVec2(start, line.y), ImVec2(min(start + 0.2 * full, high.x), high.y)
        else:
            high = ImVec2(low.x + full * min(task.progress, 1.0), high.y)
        color = imgui.get_color_u32(imgui.Col_.check_mark)
        imgui.get_window_draw_list().add_rect_filled(line, high, color)
        self._corner = ImVec2(low.x, low.y - padding)
        imgui.same_line(0, padding)
        if imgui.small_button(f"{icons.ICON_FA_XMARK}###cancel"):
            self.cancel(task)
        widgets.tooltip(f"Cancel: {task.name}" + (" (Esc)" if task is self.opener.job.task else ""))

    def _draw_task(self, task: Task) -> None:
        width = _WIDTH * imgui.get_font_size()
        imgui.text_unformatted(widgets.fitted(task.name, width))
        if widgets.progress_row(task, width):
            self.cancel(task)
