"""The app: what the user can do, and the loop that draws only when something changed."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

from ..backends import backends
from ..camera import Camera
from ..errors import InputError
from ..gpu.context import Gpu
from ..look import Look
from ..scan.open import open_scan
from ..scan.timeline import Timeline
from . import layout, theme
from .picture import Picture
from .playback import Playback
from .screenshot import save_screenshot
from .session import Session
from .window import Window

log = logging.getLogger(__name__)

_WATCH = 0.25  # seconds between looks at what workers have done while nothing is awaited
_AWAIT = 0.015  # the same while a pose or a scan is awaited


class App:
    """What the window shows and can do. Panels read it and call its commands.

    session: what the user has chosen. playback: the scan. picture: the 3D view.
    notes: all that the user was told. gesture: what a drag in the view does, None without one.
    """

    def __init__(
        self,
        window: Window,
        scans: Sequence[str],
        timeline: Timeline,
        *,
        unit: str | None = None,
        fps: float | None = None,
        up: str = "+y",
    ) -> None:
        self.scans = list(scans)
        self.session = Session(self.scans[0], look=Look(up=up))
        self.notes: list[str] = []
        self.gesture: str | None = None
        self.opening: str | None = None
        self._opening: Future[Timeline] | None = None
        self._unit, self._fps, self._up = unit, fps, up
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="open")
        self._reported: Any = None
        self.window = window
        self.picture = Picture(Gpu(window.ctx))
        self._view_size = window.buffer_size
        if self.picture.gpu.software:
            self.note(f"Drawn in software ({self.picture.gpu.device}); a graphics card is faster.")
        self.playback: Playback = self._start(timeline)

    # --- commands ---------------------------------------------------------------------

    def note(self, text: str) -> None:
        """Tell the user something; it stays in the list of messages."""
        log.info("%s", text)
        self.notes.append(text)

    def quit(self) -> None:
        """Close the window."""
        self.window.close()

    def toggle_play(self) -> None:
        """Play from the current frame, or pause."""
        self.playback.toggle(time.monotonic())

    def toggle_loop(self) -> None:
        """Play round the end, or stop there."""
        self.playback.toggle_loop(time.monotonic())

    def seek(self, index: int) -> None:
        """Go to a frame."""
        self.playback.seek(index, time.monotonic())

    def step(self, count: int) -> None:
        """Pause, and go some frames on."""
        self.playback.step(count, time.monotonic())

    def fit(self) -> None:
        """Show all of the current pose, from the same side."""
        if self.playback.pose and self.session.camera:
            bounds = self.picture.bounds(self.playback.pose)
            self.session.camera = self.session.camera.fit(bounds, self._aspect)

    def next_backend(self) -> None:
        """Draw with the next backend."""
        if self.playback.pose:
            names = list(backends())
            name, _ = self.session.chosen(self.playback.pose)
            self.session.backend = names[(names.index(name) + 1) % len(names)]

    def screenshot(self) -> None:
        """Save the picture as it is shown, without panels, in the working directory."""
        surface, request = self.picture.surface, self.picture.request
        if not self.picture.is_there or surface is None or request is None:
            self.note("There is no picture to save.")
            return
        try:
            self.note(f"Saved {save_screenshot(surface, request, self.session.scan, Path.cwd())}")
        except InputError as error:
            self.note(str(error))

    def open(self, scan: str) -> None:
        """Open another scan on a worker; the current one stays until it is there."""
        if self._opening is None:
            self.opening = scan
            self._opening = self._worker.submit(open_scan, scan, self._unit, self._fps)

    # --- the loop ---------------------------------------------------------------------

    def loop(self) -> None:
        """Run until the window is closed."""
        while not self.window.is_closing:
            self.window.wait(self._patience(time.monotonic()))
            if self._advance(time.monotonic()) or self.window.due:
                self._draw()

    def _patience(self, now: float) -> float:
        """Seconds to wait for events before looking at what else has changed."""
        look = _AWAIT if self.playback.waiting or self._opening else _WATCH
        return min(look, self.playback.player.until_next(now), self.picture.better_at - now)

    def _advance(self, now: float) -> bool:
        """Take in what time and workers have brought; True where there is something to show."""
        if self._opening and self._opening.done():
            self._take_opened(self._opening)
        self.playback.advance(now)
        timeline = self.playback.timeline
        for message in timeline.messages[self._messages_read :]:
            self._messages_read += 1
            self.note(message.text)
        report = (self.playback.pose, self.session.index, timeline.cached(), len(self.notes), self.opening)
        changed, self._reported = report != self._reported, report
        return changed or now >= self.picture.better_at

    def _take_opened(self, opening: Future[Timeline]) -> None:
        scan, self.opening, self._opening = self.opening, None, None
        try:
            timeline = opening.result()
        except Exception as error:  # whatever a file brings, the window stays
            log.debug("cannot open %s", scan, exc_info=error)
            self.note(f"Cannot open: {error}")
            return
        assert scan is not None
        self._worker.submit(self.playback.close)  # it may wait for a pose that is being read
        self.session.turn_to(scan)
        self.playback = self._start(timeline)

    def _start(self, timeline: Timeline) -> Playback:
        self.picture.clear()
        self._messages_read = 0
        self.window.title = f"{timeline.name} - Scan4D"
        return Playback(timeline, self.session)

    def _draw(self) -> None:
        self.window.begin()
        left, bottom, width, height = self.window.to_pixels(*layout.draw(self))
        self._view_size = max(width, 1), max(height, 1)
        if self._draw_picture() and not self.moving:
            self.window.touch(frames=1)  # for what the panel says about it
        self.window.fill(theme.PANEL)
        if self.picture.is_there:
            self.picture.present(left, bottom)
        self.window.end()
        log.debug("window drawn")

    def _draw_picture(self) -> bool:
        pose = self.playback.pose
        if pose is None:
            return False
        if self.session.camera is None:
            bounds = self.picture.bounds(pose)
            self.session.camera = Camera.orbit(bounds, aspect=self._aspect, up=self._up)
        return self.picture.draw(self.session.request(pose), self._view_size, self.moving)

    @property
    def moving(self) -> bool:
        """Whether the scan plays or the camera is dragged."""
        return self.playback.player.playing or self.gesture is not None

    @property
    def _aspect(self) -> float:
        return self._view_size[0] / self._view_size[1]

    def close(self) -> None:
        """Let go of everything but the window."""
        self._worker.shutdown(wait=False, cancel_futures=True)
        self.playback.close()
        self.picture.release()
