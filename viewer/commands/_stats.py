"""What pictures took: the numbers of `render --stats`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from statistics import median
from typing import Any

from ..choice.choose import Automatic
from ..drawing.renderer import Renderer
from ..drawing.request import Request
from ..drawing.timing import call_ms, pass_ms, peak_rss
from ..picture.surface import Surface

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
    (first_ms,) = call_ms(renderer, [request], surface, tick)
    first = surface.stats  # uploads and derives what later draws find done
    cpu_ms = [first_ms]
    if repeat is not None:
        call_ms(renderer, [request] * (_WARM_UPS - 1), surface, tick)
        cpu_ms = call_ms(renderer, [request] * repeat, surface, tick)
    runs = pass_ms(renderer, [request] * (repeat or 1), surface)
    return {
        "pose": request.pose.index,
        "gpu_ms": median(run.total() for run in runs),
        "cpu_ms": median(cpu_ms),
        "upload_ms": first.upload_ms,
        "uploaded_bytes": first.uploaded_bytes,
        "shared": first.shared,
        "derive_ms": first.derive_ms,
        "passes": [{"name": name, "gpu_ms": median(run[name] for run in runs)} for name in runs[0]],
        "points": _points(surface),
        "skipped": surface.stats.skipped,
        "counted": {name: read() for name, read in surface.stats.counted.items()},
        "chosen": surface.stats.chosen,
    }


def _points(surface: Surface) -> dict[str, Any]:
    counts = surface.point_counts()
    return {"in": counts.pop("in"), "drawn": counts.pop("drawn"), "culled": counts}


def summary(
    renderer: Renderer,
    surface: Surface,
    request: Request,
    frames: list[dict[str, Any]],
    automatic: Automatic | None,
) -> dict[str, Any]:
    """The whole of --stats. request: one of those that were drawn. automatic: what its backend was chosen
    for, if it was."""
    return {
        "device": renderer.gpu.device,
        "timer": renderer.gpu.timers.kind,
        "backend": str(request.backend),
        "params": asdict(request.params),
        "automatic": None if automatic is None else asdict(automatic),
        "size": list(surface.shown),
        "drawn_size": list(surface.size),
        "frames": frames,
        "bytes_gpu": renderer.nbytes + surface.nbytes,
        "peak_rss": peak_rss(),
    }
