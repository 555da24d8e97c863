"""What takes a while, over the picture: its name, how far it is, and a button that cancels it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from imgui_bundle import ImVec2, imgui

from ..task import Task
from . import widgets
from .files.opening import Opening
from .output.capture import Capture
from .output.exporting import Exporting
from .playing.playback import Playback
from .scene.viewport import Viewport
from .session import Session
from .toolbox import Toolbox

_PATIENCE = 0.3  # seconds that work may take before it is shown,
_PLAYING_PATIENCE = 2.0  # and on a pose while others are shown
_WIDTH = 28.0  # in heights of the font
_TICK = 0.1  # seconds between changes of what is shown
_FLAGS = (
    imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_focus_on_appearing
)  # fmt: skip


class Tasks:
    """All work that goes on beside the window."""

    def __init__(
        self,
        session: Session,
        playback: Playback,
        viewport: Viewport,
        opening: Opening,
        tools: Toolbox,
        exporting: Exporting,
        capture: Capture,
        note: Callable[[str], None],
    ) -> None:
        self._session, self._playback, self._viewport = session, playback, viewport
        self._opening, self._tools, self._exporting, self._note = opening, tools, exporting, note
        self._capture = capture

    @property
    def all(self) -> list[Task]:
        """All of the work, the latest last."""
        preparing = self._viewport.renderer.preparing
        tasks = [self._exporting.task, self._capture.task, preparing, self._opening.task, *self._tools.tasks]
        if self._playback.pose is None:
            tasks.append(self._playback.timeline.reading)
        return [task for task in tasks if task is not None]

    @property
    def shown(self) -> list[Task]:
        """The work to show, the latest last."""
        patience = {self._viewport.renderer.preparing: _PLAYING_PATIENCE} if self._is_playing else {}
        return [task for task in self.all if task.seconds > patience.get(task, _PATIENCE)]

    @property
    def _is_playing(self) -> bool:
        return self._playback.player.playing

    @property
    def report(self) -> list[tuple[str, int]]:
        """A value that changes when something else is to be shown."""
        return [(task.name, int(task.seconds / _TICK)) for task in self.shown]

    @property
    def ended_by_escape(self) -> list[Task]:
        """The work shown that Escape cancels: not what may have taken long, since it is pressed for other
        reasons too."""
        return [task for task in self.shown if task is not self._exporting.task]

    def on_escape(self) -> bool:
        """Cancel the latest work that Escape cancels; whether there is any."""
        lightly = self.ended_by_escape
        if lightly:
            self.cancel(lightly[-1])
        return bool(lightly)

    def cancel(self, task: Task) -> None:
        """Stop a piece of the work; what was shown before it stays."""
        is_told = task is self._playback.timeline.reading  # by what the timeline says of the frame
        if task is self._opening.task:
            self._opening.cancel()
        elif task is self._viewport.renderer.preparing:
            self._choose_prepared()
        task.cancel()
        if not is_told:
            self._note(f"Cancelled: {task.name}.")

    def _choose_prepared(self) -> None:
        """Go back to what was drawn before, or to plain points."""
        if self._viewport.request is not None:
            drawn, chosen = self._viewport.request.look, self._session.document.look
            pose = self._playback.timeline.ready(self._session.index) or self._viewport.request.pose
            request = self._viewport.without_preparing(replace(self._viewport.request, pose=pose))
            look = request.look
            if look.color_by == drawn.color_by:  # which may stand for a scalar that the frame lacks
                look = replace(look, color_by=chosen.color_by)
            before = replace(self._session.document.drawn_by(str(request.backend)), look=look)
            self._session.history.change("Cancel preparing", before)

    def draw(self, place: tuple[float, float, float, float], head: float) -> None:
        """Declare the work over the top of the 3D view.

        place: of the view: left, top, width, height. head: how much of its top is taken by notes.
        """
        tasks = self.shown
        if not tasks:
            return
        left, top, width, _ = place
        em = imgui.get_font_size()
        own_width = min(_WIDTH * em, 0.9 * width)
        imgui.set_next_window_pos(ImVec2(left + (width - own_width) / 2, top + head + em))
        imgui.set_next_window_size_constraints(ImVec2(own_width, 0), ImVec2(own_width, 1e4))
        imgui.begin("tasks", flags=_FLAGS)
        for task in tasks:
            self._draw_task(task)
        imgui.end()

    def _draw_task(self, task: Task) -> None:
        gap = imgui.get_style().item_spacing.x
        width = imgui.get_content_region_avail().x
        imgui.text_unformatted(widgets.fitted(task.name, width))
        button = imgui.calc_text_size("Cancel").x + 2 * imgui.get_style().frame_padding.x
        size = ImVec2(width - button - gap, imgui.get_frame_height())
        words = f"{task.seconds:.0f} s"
        if task.progress is None:
            imgui.progress_bar(-task.seconds, size, words)  # a negative share: it only moves
        else:
            imgui.progress_bar(task.progress, size, f"{100 * task.progress:.0f} %, {words}")
        imgui.same_line()
        if imgui.button(f"Cancel##{id(task)}"):
            self.cancel(task)
        widgets.tooltip("Cancel (Esc)" if task in self.ended_by_escape else "Cancel")
