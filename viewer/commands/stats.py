"""What pictures took: the numbers of `render --stats`."""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict
from statistics import median
from typing import Any

from ..frame import Request, render_frame
from ..gpu.surface import Surface
from ..renderer import Renderer

_WARM_UPS = 2


def draw_count(repeat: int | None) -> int:
    """How often `draw_measured` draws with its timers off."""
    return 1 if repeat is None else _WARM_UPS + repeat


def draw_measured(
    renderer: Renderer, request: Request, surface: Surface, repeat: int | None, tick: Callable[[], object]
) -> dict[str, Any]:
    """Draw a picture and say what it took, as one of the `frames`.

    repeat: how many draws the medians are of, after two warm-ups; None: the first draw
    counts. cpu_ms is taken with pass timers off, because on software drivers they wait
    between passes; gpu_ms and the passes come from as many further draws with them on.
    """
    cpu_ms, first = [], None
    for _ in range(draw_count(repeat)):
        start = time.perf_counter()
        draw(renderer, request, surface)
        surface.image()
        cpu_ms.append((time.perf_counter() - start) * 1e3)
        first = first or surface.stats  # uploads and derives what later draws find done
        tick()
    assert first is not None
    timers = renderer.gpu.timers
    timers.enabled = True
    try:
        runs = [draw(renderer, request, surface) for _ in range(repeat or 1)]
    finally:
        timers.enabled = False
    return {
        "pose": request.pose.index,
        "gpu_ms": median(run.total() for run in runs),
        "cpu_ms": median(cpu_ms[_WARM_UPS:] or cpu_ms),
        "upload_ms": first.upload_ms,
        "derive_ms": first.derive_ms,
        "passes": [{"name": name, "gpu_ms": median(run[name] for run in runs)} for name in runs[0]],
        "points": _points(surface),
        "skipped": surface.stats.skipped,
    }


def draw(renderer: Renderer, request: Request, surface: Surface) -> Counter[str]:
    """Draw until the picture is complete; milliseconds of each pass while timers are on."""
    passes: Counter[str] = Counter()
    unfinished = True
    while unfinished:
        unfinished = render_frame(renderer, request, surface)
        for name, ms in surface.stats.passes:
            passes[name] += ms  # type: ignore[assignment]
    return passes


def _points(surface: Surface) -> dict[str, Any]:
    counts = surface.point_counts()
    return {"in": counts.pop("in"), "drawn": counts.pop("drawn"), "culled": counts}


def summary(
    renderer: Renderer, surface: Surface, request: Request, frames: list[dict[str, Any]]
) -> dict[str, Any]:
    """All of --stats. request: one of those that were drawn."""
    return {
        "device": renderer.gpu.device,
        "timer": renderer.gpu.timers.kind,
        "backend": str(request.backend),
        "params": asdict(request.params),
        "size": list(surface.size),
        "frames": frames,
        "bytes_gpu": renderer.nbytes + surface.nbytes,
        "peak_rss": _peak_rss(),
    }


def _peak_rss() -> int | None:
    """The most bytes of memory that this process has had; None where the system does not tell."""
    if sys.platform == "win32":
        return None
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
