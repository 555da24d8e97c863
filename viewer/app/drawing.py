"""The picture in the view: asked for as the document has it, and drawn while nothing better is to be done."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from ..drawing.renderer import Renderer
from . import theme
from .failures import Failures
from .output.capture import Capture
from .part import WindowPart, remembered
from .playing.playback import Playback
from .playing.ranging import Ranging
from .scene.activity import Activity
from .scene.framing import Framing
from .scene.glide import Glide
from .scene.rendering import Rendering
from .scene.steering import Steering
from .scene.viewport import Viewport
from .session import Session
from .window import Window
from .window_look import WindowLook

log = logging.getLogger(__name__)
_RATE = 25.0  # pictures a second while the camera moves
_FASTEST = 30.0  # the same while a scan plays that has more
_BUSY = 0.9  # of the time between pictures that the window may take over one


@dataclass(eq=False)
class Drawing(WindowPart):
    """Draws the picture."""

    name = "drawing"
    doing = "Drawing"
    turn = 5
    window: Window
    session: Session
    playback: Playback
    renderer: Renderer
    viewport: Viewport
    failures: Failures
    steering: Steering
    framing: Framing
    glide: Glide
    activity: Activity
    rendering: Rendering
    ranging: Ranging
    capture: Capture
    window_look: WindowLook
    note: Callable[[str], None]
    is_replaying: Callable[[], bool]
    slow_devices: tuple[str, ...] = remembered(())  # of which the user knows that they draw in software

    def __post_init__(self) -> None:
        self._seen: Any = None  # the pose, the frame, and the frames in memory
        self._announced: Any = None  # the scan and the renderer that were last shown as chosen
        gpu, slow = self.renderer.gpu, self.slow_devices
        if gpu.software and gpu.device not in slow:
            self.slow_devices = (*slow, gpu.device)
            self.note(f"Scan4D draws without a graphics card ({gpu.device}); a graphics card is faster.")

    def begin_scan(self, timeline: object) -> None:
        """Drop the picture of the scan before."""
        self.viewport.clear()

    def set_view(self, view: tuple[int, int, int, int]) -> None:
        """Take in where the 3D view is: left, bottom, width, height in pixels from the lower left."""
        left, bottom, width, height = view
        rectangle = left, bottom, max(width, 1), max(height, 1)
        if rectangle != self.viewport.rectangle:
            self.viewport.rectangle = rectangle
            top = self.window.buffer_size[1] - bottom - height
            log.debug("view at %d,%d %dx%d pixels", left, top, width, height)

    def next_change(self, now: float) -> float:
        """Seconds until a better picture may be drawn."""
        return min(self.viewport.better_at(self.playback.player.playing), self._refines_at) - now

    def advance(self, now: float) -> bool:
        """Look at what is shown; whether another frame is, or a better picture of it is to be drawn."""
        playback = self.playback
        before, self._seen = self._seen, (playback.pose, self.session.index, playback.timeline.cached())
        return before != self._seen or now >= self.viewport.better_at(playback.player.playing)

    @property
    def _refines_at(self) -> float:
        """When the picture may be refined, by the clock: while nothing is acted on."""
        if self.steering.moves:
            return math.inf
        return self.viewport.refines_at(self.playback.player.playing)

    def refine(self) -> None:
        """Draw one more sample of a picture at rest, in a turn in which nothing else is to be drawn."""
        if time.monotonic() >= self._refines_at:
            with self.failures.reported("Refining"):
                if self.viewport.refine():
                    self.window.touch(frames=1)

    def draw(self) -> bool:
        """Draw the picture that is asked for; whether it drew one."""
        pose = self.playback.pose
        if pose is None:
            return False
        self.steering.settle(pose)
        chosen = self.playback.timeline, self.rendering.backend
        if chosen != self._announced:  # its first picture may take seconds: the window says so before
            self._announced = chosen
            self.window.touch()
            return False
        now, session = time.monotonic(), self.session
        self.rendering.tell_missing(pose)
        request = self.ranging.ranged(session.document.request(pose, session.laid.layers(pose)))
        request = replace(request, look=theme.themed(request.look, self.window_look.palette))
        may_glide = self.steering.rests(now) and not self.framing.follows and not self.is_replaying()
        request = replace(request, camera=self.glide.follow(request.camera, may_glide, now))
        held = self.steering.moves or self.glide.is_on
        drew = self.viewport.draw(request, playing=self.playback.player.playing, held=held)
        if drew and self.viewport.problem is not None:
            self.failures.report("Drawing", self.viewport.problem)
        elif drew:
            self.capture.note_shown()
        if drew and not self.activity.is_moving:
            self.window.touch(frames=1)  # for what the panel says about it
        return drew

    def present(self, is_dimmed: bool) -> None:
        """Show the picture in the window. is_dimmed: whether it is not the one that is asked for."""
        viewport = self.viewport
        self.window.fill(self.window_look.palette.panel)
        if self.playback.is_empty:
            viewport.present_nothing()
        elif viewport.is_visible and (viewport.is_there or self.playback.problem is None):
            viewport.present(is_dimmed or viewport.shows_another_scan)

    @property
    def goal_ms(self) -> float:
        """How long the window may take over a picture: as long as the scan's frames last while it plays,
        and as the screen needs, which `swap_buffers` may wait for."""
        player = self.playback.player
        rate = player.rate if player.playing else _RATE
        wanted_ms = _BUSY * 1e3 / min(max(rate, _RATE if self.steering.moves else 0), _FASTEST)
        return max(wanted_ms, self.window.refresh_ms / _BUSY)
