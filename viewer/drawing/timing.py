"""What pictures take: time of the call and of its passes, and memory."""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

from ..picture.surface import Surface
from .frame import render_frame
from .renderer import Renderer
from .request import Request

VIEW_STEP = 1.0  # degrees that the eye moves from one view to the next
_PROCESS = Path("/proc/self")  # Linux


def draw(renderer: Renderer, request: Request, surface: Surface) -> Counter[str]:
    """Draw until the picture is complete; milliseconds of each pass while timers are on.

    What was prepared on the way stands in `surface.stats`.
    """
    passes: Counter[str] = Counter()
    upload_ms = derive_ms = 0.0
    unfinished = True
    while unfinished:
        unfinished = render_frame(renderer, request, surface)
        upload_ms, derive_ms = upload_ms + surface.stats.upload_ms, derive_ms + surface.stats.derive_ms
        for name, ms in surface.stats.passes:
            passes[name] += ms  # type: ignore[assignment]
    surface.stats.upload_ms, surface.stats.derive_ms = upload_ms, derive_ms
    return passes


def new_views(request: Request, count: int, first: int = 0) -> list[Request]:
    """The request after `count` other views of its pose, a degree from each to the next; it is the last.

    first: degrees of the last one, in place of 0.
    """
    turns = range(first + count - 1, first - 1, -1)
    return [request.seen_by(request.camera.orbited(turn * VIEW_STEP, 0.0)) for turn in turns]


def call_ms(
    renderer: Renderer, requests: Iterable[Request], surface: Surface, tick: Callable[[], object] = int
) -> list[float]:
    """Wall time of each picture with reading it back, ms; `tick` is called after each.

    Each is drawn whole, but with what the backend keeps of the one before. Timers should be off: on software
    drivers they wait between passes.
    """
    times = []
    for request in requests:
        surface.drawn = {}
        start = time.perf_counter()
        draw(renderer, request, surface)
        surface.image()
        times.append((time.perf_counter() - start) * 1e3)
        tick()
    return times


def undisturbed_ms(renderer: Renderer, request: Request, surface: Surface, repeat: int) -> float:
    """Milliseconds that a draw takes with the picture read back, as on a machine that does nothing else: the
    least of `repeat`.

    Of a driver that draws in software, that is by processor time: this thread's, which waits for the others,
    and theirs, spread over all processors. Else wall time.
    """
    times = []
    for _ in range(repeat):
        process, thread = time.process_time(), time.thread_time()
        (wall,) = call_ms(renderer, [request], surface)
        own = (time.thread_time() - thread) * 1e3
        others = (time.process_time() - process) * 1e3 - own
        times.append(own + others / (os.cpu_count() or 1) if renderer.gpu.software else wall)
    return min(times)


def pass_ms(renderer: Renderer, requests: Iterable[Request], surface: Surface) -> list[Counter[str]]:
    """Milliseconds on the GPU of each pass, in each of these pictures; see `call_ms`."""
    timers = renderer.gpu.timers
    timers.enabled = True
    found = []
    try:
        for request in requests:
            surface.drawn = {}
            found.append(draw(renderer, request, surface))
    finally:
        timers.enabled = False
    return found


def peak_rss() -> int | None:
    """The most bytes of memory that this process has had; None where the system does not tell.

    On Linux since the last `reset_peak_rss`.
    """
    with suppress(OSError):
        for line in (_PROCESS / "status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    if sys.platform == "win32":
        return None
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


def reset_peak_rss() -> None:
    """Let `peak_rss` begin anew, where the system can (proc(5), clear_refs)."""
    with suppress(OSError):
        (_PROCESS / "clear_refs").write_text("5")
