"""What the view waits for, said over the picture, which is dimmed meanwhile."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from imgui_bundle import ImVec2, imgui

from ...files import printable
from ...scan.times import frame_in_words
from ...task import Task
from .. import widgets
from ..part import ViewArea, WindowPart
from ..playing.playback import Playback
from ..scene.viewport import Viewport
from ..session import Session
from .opener import Opener
from .scans import title

_PATIENCE = 0.3  # seconds that may pass before a wait is shown
_WIDTH = 24.0  # in heights of the font


class Awaited(NamedTuple):
    """A thing that the view waits for. words: as users read it. task: None where nobody knows how far."""

    words: str
    task: Task | None


@dataclass(eq=False)
class Loading(WindowPart):
    """Says that the picture is of another scan, or of another frame, than the one that is asked for.

    awaited: what is waited for, None where the picture is the right one, or has not been wrong for long.
    """

    name = "loading"
    doing = "Loading"
    layer = 21
    shows = "The loading message"
    session: Session
    playback: Playback
    viewport: Viewport
    opener: Opener
    cancel_task: Callable[[Task], object]

    def __post_init__(self) -> None:
        self._since = math.inf  # by the clock, when the frame that is asked for began to be missed
        self.awaited: Awaited | None = None

    def advance(self, now: float) -> bool:
        """Look at what is missed; whether something else is to be said. now: by the clock."""
        before = self.awaited
        is_missed = self.playback.waiting and (self.playback.is_held or not self.playback.player.playing)
        self._since = min(self._since, now) if is_missed else math.inf
        self.awaited = self._find(now)
        return self.awaited != before

    def _find(self, now: float) -> Awaited | None:
        opening, playback = self.opener.job, self.playback
        if opening.scan is not None and opening.task is not None and opening.task.seconds > _PATIENCE:
            return Awaited(f"Loading {title(opening.scan)}", opening.task)
        if playback.problem is not None or self.viewport.problem is not None:
            return None
        task = playback.timeline.loading or self.viewport.renderer.work.preparing
        if self.viewport.shows_another_scan:
            return Awaited(f"Loading {title(self.session.scan)}", task)
        if now <= self._since + _PATIENCE:
            return None
        is_read = playback.timeline.ready(self.session.index) is not None
        doing = "Preparing" if is_read else "Loading"
        return Awaited(f"{doing} {frame_in_words(self.session.index)}", task)

    def dialog(self, view: ViewArea) -> None:
        """Declare it in the middle of the view."""
        if self.awaited is None:
            return
        words, task = self.awaited
        left, top, width, height = view
        own_width = min(_WIDTH * imgui.get_font_size(), 0.9 * width)
        middle = ImVec2(left + width / 2, top + height / 2)
        imgui.set_next_window_pos(middle, imgui.Cond_.always, ImVec2(0.5, 0.5))
        imgui.set_next_window_size_constraints(ImVec2(own_width, 0), ImVec2(own_width, 1e4))
        imgui.begin("loading", flags=widgets.FLOATING)
        room = imgui.get_content_region_avail().x
        imgui.text_unformatted(widgets.fitted(printable(words), room))
        style = imgui.get_style()
        button = imgui.calc_text_size("Cancel").x + 2 * style.frame_padding.x + style.item_spacing.x
        if task is not None and widgets.progress_row(task, room - button):
            self.cancel_task(task)
        imgui.end()
