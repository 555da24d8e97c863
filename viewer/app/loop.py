"""The window's loop: it sleeps until something has changed, and draws only then."""

from __future__ import annotations

import logging
import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from . import layout, theme
from .files import dropping
from .turns import Turns

if TYPE_CHECKING:
    from collections.abc import Callable

    from .app import App
    from .closing import Signals

log = logging.getLogger(__name__)

_WATCH = 0.25  # seconds between looks at what workers have done while nothing is awaited
_AWAIT = 0.015  # the same while a pose or a scan is awaited
_CALM = 0.1  # seconds before going on after something has failed, which might do so again at once
_RATE = 25.0  # pictures a second while the camera moves
_FASTEST = 30.0  # the same while a scan plays that has more
_BUSY = 0.9  # of the time between pictures that the window may take over one


class Loop:
    """Runs an app until its window is closed, or a signal says so. watch: called at the end of each turn."""

    def __init__(self, app: App, signals: Signals, watch: Callable[[App], None] | None = None) -> None:
        self._app = app
        self._signals = signals
        self._watch = watch
        self._turns = Turns()
        self._reported: Any = None
        self._announced: Any = None  # the scan and the renderer that were last shown as chosen
        self._told = 0, 0  # how many messages, and how many of them are shown

    def run(self) -> None:
        """Go on until the window is closed, whatever goes wrong meanwhile."""
        failures = self._app.failures
        while not self._ends():
            before = failures.count
            with failures.told("The window"):
                self._turn()
            if self._watch is not None:
                self._watch(self._app)
            if failures.count != before:
                time.sleep(_CALM)

    def _turn(self) -> None:
        patience = _WATCH
        with self._app.failures.told("The window"):  # the turn goes on without it
            patience = self._patience(time.monotonic())
        self._turns.add("late", 1e3 * self._app.window.wait(patience))
        with self._turns.part("advance"):
            changed = self._advance(time.monotonic())
        if changed or self._app.window.due:
            self._draw()
        else:
            self._refine()
        self._turns.end()

    def _ends(self) -> bool:
        """Whether the window is closed, and the user was asked where that cancels an export; a signal asks
        nobody."""
        window = self._app.window
        if self._signals.came:
            return True
        if window.is_closing and self._app.exporting.keeps_open():
            window.is_closing = False
            window.touch()
        return window.is_closing

    def _patience(self, now: float) -> float:
        """Seconds to wait for events before looking at what else has changed."""
        app = self._app
        waits = (
            app.playback.waiting
            or app.tasks.all
            or app.scans.waits
            or app.browser.waits
            or app.capture.waits
            or app.thumbnails.waits
            or app.choosing.waits
        )
        look = _AWAIT if waits else _WATCH
        changes = (
            app.playback.player.until_next(now), app.notices.next_change(now),
            app.steering.turntable.next_change(now), app.glide.next_change(now), app.replayer.until_next(now),
            app.naming.next_change(now),
        )  # fmt: skip
        playing, viewport = app.playback.player.playing, app.viewport
        return min(look, *changes, viewport.better_at(playing) - now, self._refines_at - now)

    @property
    def _refines_at(self) -> float:
        """When the picture may be refined, by the clock: while nothing is acted on."""
        app = self._app
        return math.inf if app.steering.moves else app.viewport.refines_at(app.playback.player.playing)

    def _refine(self) -> None:
        """Draw one more sample of a picture at rest, in a turn in which nothing else is to be drawn."""
        if time.monotonic() >= self._refines_at:
            with self._turns.part("refine"), self._app.failures.told("Refining"):
                if self._app.viewport.refine():
                    self._app.window.touch(frames=1)

    def _advance(self, now: float) -> bool:
        """Take in what time and workers have brought; True where there is something to show."""
        app = self._app
        changed = False
        for name, advance in (
            ("Opening", app.take_opened),
            ("Taking what was dropped", self._take_dropped),
            ("Listing scans", app.scans.advance),
            ("Listing a folder", app.browser.advance),
            ("Keeping", lambda: app.keeping.advance(now)),
            ("Looking for changes", lambda: app.changes.advance(now)),
            ("Exporting", app.exporting.advance),
            ("Saving", app.capture.advance),
            ("Replaying", lambda: app.replayer.advance(now)),
            ("Preparing", app.ahead.advance),
            ("Pacing", lambda: app.pacing.advance(now)),
            ("Playing", lambda: app.playback.advance(now)),
            ("Ranging", lambda: app.ranging.advance(now, not (app.moving or app.playback.waiting))),
            ("Picturing frames", lambda: app.thumbnails.advance(not (app.moving or app.playback.waiting))),
            ("Loading", lambda: app.loading.advance(now)),
            ("Naming the renderer", lambda: app.naming.advance(now)),
            ("Reading", app.pass_on_messages),
            ("Turning", lambda: app.steering.advance(now)),
            ("Gliding", lambda: app.glide.is_on),
            ("Keeping the history", lambda: app.settle(now)),
            ("Advancing tools", app.tools.advance),
            ("Choosing the renderer", lambda: app.choosing.advance(self._is_at_rest(now), now)),
            ("Counting", lambda: app.counting.advance(app.viewport, not app.moving, now)),
        ):
            with app.failures.told(name):
                changed |= bool(advance())
        told = app.notices.count, len(app.notices.shown(now))
        if told != self._told:
            app.window.touch()  # ImGui shows a window that fits its content from the second frame on
            self._told = told
        cached = app.playback.timeline.cached()
        report = (app.playback.pose, app.session.index, cached, app.tasks.report)
        changed |= report != self._reported
        self._reported = report
        return changed or now >= app.viewport.better_at(app.playback.player.playing)

    def _is_at_rest(self, now: float) -> bool:
        """Whether the view stays as it is."""
        app = self._app
        goes_on = app.moving or app.glide.is_on or app.replayer.replaying is not None
        return app.steering.rests(now) and not goes_on

    def _take_dropped(self) -> None:
        app = self._app
        dropping.take(
            app.window.take_dropped(),
            app.scans,
            app.sessions,
            app.replayer.replay,
            app.tools.take_file,
            app.note,
        )

    def _draw(self) -> None:
        app, start = self._app, time.perf_counter()
        with self._turns.part("widgets"):
            app.window.begin()
            with app.failures.told("The window"):
                app.place_view(app.window.to_pixels(*layout.draw(app)))
        start_picture, drew = time.perf_counter(), False
        with app.failures.told("Drawing"):
            drew = self._draw_picture()
        self._turns.add("picture" if drew else "upload", (time.perf_counter() - start_picture) * 1e3)
        if drew and not app.moving:
            app.window.touch(frames=1)  # for what the panel says about it
        with self._turns.part("show"):
            with app.failures.told("Showing the picture"):
                app.window.fill(app.palette.panel)
                if app.viewport.is_visible and (app.viewport.is_there or app.playback.problem is None):
                    app.viewport.present(app.loading.awaited is not None or app.viewport.shows_another_scan)
            app.window.end()
        if drew:
            app.viewport.took((time.perf_counter() - start) * 1e3, self._goal_ms)
        log.debug("window drawn")

    def _draw_picture(self) -> bool:
        app, pose = self._app, self._app.playback.pose
        if pose is None:
            return False
        app.steering.settle(pose)
        chosen = app.playback.timeline, app.rendering.backend
        if chosen != self._announced:  # its first picture may take seconds: the window says so before
            self._announced = chosen
            app.window.touch()
            return False
        now, playing = time.monotonic(), app.playback.player.playing
        app.rendering.tell_missing(pose)
        request = app.ranging.ranged(app.document.request(pose, app.session.laid.layers(pose)))
        request = replace(request, look=theme.themed(request.look, app.palette))
        may_glide = app.steering.rests(now) and not app.steering.follows and app.replayer.replaying is None
        request = replace(request, camera=app.glide.follow(request.camera, may_glide, now))
        drew = app.viewport.draw(request, playing=playing, held=app.steering.moves or app.glide.is_on)
        if drew and app.viewport.problem is not None:
            app.failures.tell("Drawing", app.viewport.problem)
        elif drew:
            app.capture.note_shown()
        return drew

    @property
    def _goal_ms(self) -> float:
        """How long the window may take over a picture: as long as the scan's frames last while it plays,
        and as the screen needs, which `swap_buffers` may wait for."""
        player = self._app.playback.player
        rate = player.rate if player.playing else _RATE
        wanted_ms = _BUSY * 1e3 / min(max(rate, _RATE if self._app.steering.moves else 0), _FASTEST)
        return max(wanted_ms, self._app.window.refresh_ms / _BUSY)
