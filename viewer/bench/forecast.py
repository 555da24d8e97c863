"""How long a benchmark will take."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from ..scan.estimate import cloud_normals
from .plan import Group
from .run import PREPARED, Bench
from .scenes import catalog

_REHEARSED = "torus"
_LOADING = 3.0  # seconds for a scene
_BARE_POINTS = 300_000  # of a scan whose normals are estimated


def forecast(bench: Bench, groups: Sequence[Group]) -> float:
    """The seconds that measuring groups will take, from one view of a torus that all contenders draw.

    That view also loads libraries and compiles shaders, so that no number holds it. Raises
    KeyboardInterrupt where Ctrl-C stopped it.
    """
    settings = bench.settings
    pace = {
        judged: _rehearse(bench, [group for group in groups if group.judged == judged])
        for judged in {group.judged for group in groups}
    }
    estimating = _estimating() * _BARE_POINTS
    count = catalog.usual(_REHEARSED, "n") or 1

    total = 0.0
    for group in groups:
        drawing, judging = pace[group.judged]
        pictures = settings.views + bench.walks(group) * settings.frames
        total += _LOADING + len(group.contenders) * pictures * (
            judging + drawing * max(1.0, (group.count or 0) / count)
        )
        if catalog.is_bare(group.scene):
            total += len(group.contenders) * min(settings.views, PREPARED) * estimating
    return total


def _rehearse(bench: Bench, groups: Sequence[Group]) -> tuple[float, float]:
    """The seconds that it takes to draw and to judge a picture of a torus. groups: of one kind."""
    contenders = tuple(dict.fromkeys(c for group in groups for c in group.contenders))
    rehearsed = Group(_REHEARSED, contenders, judged=groups[0].judged)
    settings = bench.settings
    drawn = {"first_ms": 1, "cpu_ms": 2 * settings.repeat, "same_ms": settings.repeat}  # of a view
    for size in ((96, 64), settings.size):
        rehearsal = Bench(
            bench.renderer, replace(settings, size=size, views=1, frames=min(2, settings.frames))
        )
        start = time.perf_counter()
        rows = rehearsal.measure(rehearsed)
        seconds = time.perf_counter() - start
        if rehearsal.stopped:
            raise KeyboardInterrupt
    times = [row[name]["median"] * count for row in rows for name, count in drawn.items()]
    drawing = sum(times) / 1e3 / len(rows)
    if not rehearsed.judged:
        return drawing, 0.0
    pictures = 1 + rehearsal.walks(rehearsed) * rehearsal.settings.frames  # each about as long
    return drawing, max(seconds / (pictures * len(rows)) - drawing, 0)


def _estimating() -> float:
    """The seconds that estimating normals takes for a point."""
    cloud = catalog.subject(_REHEARSED, None).moment(0).pose.cloud
    start = time.perf_counter()
    cloud_normals(replace(cloud, normals=None))
    return (time.perf_counter() - start) / len(cloud)
