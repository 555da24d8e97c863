"""The window's loop: it sleeps until something has changed, and draws only then."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

from .app import App
from .closing import Signals
from .turns import Turns

log = logging.getLogger(__name__)

_WATCH = 0.25  # seconds between looks at what workers have done while nothing is awaited
_AWAIT = 0.015  # the same while a pose or a scan is awaited
_CALM = 0.1  # seconds before going on after something has failed, which might do so again at once


class Loop:
    """Runs an app until its window is closed, or a signal says so. watch: called at the end of each turn."""

    def __init__(self, app: App, signals: Signals, watch: Callable[[App], None] | None = None) -> None:
        self._app = app
        self._signals = signals
        self._watch = watch
        self._turns = Turns()

    def run(self) -> None:
        """Go on until the window is closed, whatever goes wrong meanwhile."""
        failures = self._app.failures
        while not self._ends():
            before = failures.count
            with failures.reported("The window"):
                self._turn()
            if self._watch is not None:
                self._watch(self._app)
            if failures.count != before:
                time.sleep(_CALM)

    def _turn(self) -> None:
        app, patience = self._app, _WATCH
        with app.failures.reported("The window"):  # the turn goes on without it
            patience = app.patience(_AWAIT, _WATCH, time.monotonic())
        self._turns.add("late", 1e3 * app.window.wait(patience))
        with self._turns.part("advance"):
            changed = app.advance(time.monotonic())
        if changed or app.window.due:
            self._draw()
        else:
            with self._turns.part("refine"):
                app.drawing.refine()
        self._turns.end()

    def _ends(self) -> bool:
        """Whether the window is closed, and the user was asked where that cancels an export; a signal asks
        nobody."""
        window = self._app.window
        if self._signals.came:
            return True
        if window.is_closing and self._app.exporting.asks_to_stay():
            window.is_closing = False
            window.touch()
        return window.is_closing

    def _draw(self) -> None:
        app, start = self._app, time.perf_counter()
        with self._turns.part("widgets"):
            app.window.begin()
            with app.failures.reported("The window"):
                app.drawing.set_view(app.window.to_pixels(*app.layout.draw()))
        start_picture, drew = time.perf_counter(), False
        with app.failures.reported("Drawing"):
            drew = app.drawing.draw()
        self._turns.add("picture" if drew else "upload", (time.perf_counter() - start_picture) * 1e3)
        with self._turns.part("show"):
            with app.failures.reported("Showing the picture"):
                app.drawing.present(is_dimmed=app.loading.awaited is not None)
            app.window.end()
        if drew:
            app.viewport.took((time.perf_counter() - start) * 1e3, app.drawing.goal_ms)
        log.debug("window drawn")
