"""A start of the window that tells when it got how far: `start.py` runs it in a process of its own.

    python tools/experiments/window/started.py SCAN

A line of JSON on standard output: [stage, seconds by the monotonic clock, seconds of processor time of all
threads] of each, when it was over, and the seconds that shaders took to compile. The window closes itself
when the picture is there as it was asked for.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from functools import wraps
from typing import Any

STAGES: list[tuple[str, float, float]] = []
SHADERS = [0.0, 0]


def note(stage: str) -> None:
    """A stage is over; the first time that it is counts."""
    if all(name != stage for name, *_ in STAGES):
        STAGES.append((stage, time.monotonic(), time.process_time()))


def noted(stage: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, after which a stage is over."""

    @wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        result = function(*args, **kwargs)
        note(stage)
        return result

    return call


def counted(compiling: Callable[..., Any]) -> Callable[..., Any]:
    """The function, whose time is that of shaders."""

    @wraps(compiling)
    def call(*args: Any) -> Any:
        start = time.perf_counter()
        try:
            return compiling(*args)
        finally:
            SHADERS[0] += time.perf_counter() - start
            SHADERS[1] += 1

    return call


def before(act: Callable[[], None], function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, before which something else is done."""

    @wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        act()
        return function(*args, **kwargs)

    return call


def observe_window() -> None:
    """Note what the window does from here on, all of whose modules are there."""
    note("the window's modules")
    from viewer.app import app, window
    from viewer.gpu.context import Gpu

    window.Window.__init__ = noted("window, context", window.Window.__init__)
    window.Window.end = noted("widgets shown", window.Window.end)
    app.App.__init__ = noted("its parts", app.App.__init__)
    Gpu._compile = counted(Gpu._compile)  # `keep` calls it by the class


def watch(app: Any) -> None:
    """See how far it is after each turn of the loop."""
    if app.playback.pose is not None:
        note("pose read")
    if app.viewport.is_there:
        note("first picture")
        if app.viewport.is_complete:
            note("as asked")
            app.window.close()


def main() -> None:
    """Start the window as the command line does, and print."""
    note("interpreter")
    import viewer.app
    from viewer.commands import _line

    run = viewer.app.run

    def observed(*args: Any, **kwargs: Any) -> int:
        note("command line, scan opened")
        from viewer.app import settings  # which are loaded when all is imported

        settings.load = before(observe_window, settings.load)
        return run(*args, **kwargs, watch=watch)

    viewer.app.run = observed
    code = _line.run(["view", *sys.argv[1:]])
    print(json.dumps({"stages": STAGES, "shaders": SHADERS}))
    sys.exit(code)


if __name__ == "__main__":
    main()
