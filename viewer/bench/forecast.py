"""How long a benchmark will take."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from ..scan.estimate import estimate_normals
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
    contenders = tuple(dict.fromkeys(c for group in groups for c in group.contenders))
    settings = bench.settings
    for size in ((96, 64), settings.size):
        rehearsal = Bench(bench.renderer, replace(settings, size=size, views=1, frames=2))
        start = time.perf_counter()
        rows = rehearsal.measure(Group(_REHEARSED, contenders))
        seconds = time.perf_counter() - start
        if rehearsal.stopped:
            raise KeyboardInterrupt
    count = rows[0]["n"]
    drawing = sum(row["cpu_ms"]["median"] for row in rows) * (2 + 2 * settings.repeat) / 1e3 / len(rows)
    # The view, and the two frames of a walk, each about as long.
    judging = max(seconds / (3 * len(rows)) - drawing, 0)
    estimating = _estimating() * _BARE_POINTS / count

    total = 0.0
    for group in groups:
        pictures = settings.views + bench.walks(group) * settings.frames
        total += _LOADING + len(group.contenders) * pictures * (
            judging + drawing * max(1.0, (group.count or 0) / count)
        )
        if catalog.is_bare(group.scene):
            total += len(group.contenders) * min(settings.views, PREPARED) * estimating
    return total


def _estimating() -> float:
    """The seconds that estimating normals takes for the scene that is rehearsed."""
    cloud = catalog.subject(_REHEARSED, None).moment(0).pose.cloud
    start = time.perf_counter()
    estimate_normals(replace(cloud, normals=None))
    return time.perf_counter() - start
