"""How long each value of `instancing` takes, and whether `auto` takes the fastest on this device.

A sphere fills half of the picture (--away 1), with radii of 1.5 times the spacing, in random order and in
that of a scanner. The values take turns."""

from __future__ import annotations

import os
import sys
import tempfile
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

from experiments.pictures import renderer
from experiments.script import Failed, Script
from experiments.speed.clouds import ORDERS, even_sphere
from experiments.tables import Row
from experiments.timing import CORES, by_turns
from viewer.backends import FrameView, backend, backends
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.drawing.timing import draw, pass_ms
from viewer.errors import Scan4DError
from viewer.gpu.pose import GpuPose
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose
from viewer.view import View

SURFELS = backend("surfels")
FEEDS = [feed for p in SURFELS.parameters if p.name == "instancing" for feed in p.choices]
PASSES = ("one", "two")
CAMERA = Camera(eye=(0.3, 0.5, 2.6), target=(0, 0, 0), fov_y=46)
_SHADING = "shade"  # the pass that all pictures have
_SLOWER = 1.1  # times the fastest, that `auto` may take


def splats(options: Namespace) -> Iterator[Row]:
    """Drawing surfels by each value of `instancing`, without shading and reading back: the least wall time,
    and the least processor time over two cores."""
    gpu = renderer().gpu
    surface = Surface(gpu, options.size)
    settings = dict(setting.split("=", 1) for setting in options.set)
    for count, order in product(options.counts, ORDERS):
        pose = GpuPose(gpu, Pose(0, 0.0, "sphere", even_sphere(count, order)))
        camera = replace(CAMERA, eye=tuple(options.away * np.array(CAMERA.eye)))
        surface.start(pose, View.of(camera, surface.size, pose.cloud.origin, pose.bounds))
        works = {}
        for feed in options.feeds or FEEDS:
            frame = FrameView(surface.view, SURFELS.params({**settings, "instancing": feed}))
            works[feed] = partial(SURFELS.draw, pose, frame, surface)
        for feed, (wall, busy) in by_turns(works, options.rounds, gpu.ctx.finish, of="least").items():
            yield {
                "points": count,
                "order": order,
                "instancing": feed,
                "ms": wall,
                "processor, ms": busy / CORES,
            }


def chosen(options: Namespace) -> Iterator[Row]:
    """Times of the passes of each renderer that has `instancing`, without shading, by timer queries where the
    driver's are right; and what `auto` takes, for a user who starts for the first time.

    Raises Failed where it takes a value that is slower than the fastest by more than a tenth.
    """
    slow = []
    with tempfile.TemporaryDirectory() as home:
        os.environ["XDG_CACHE_HOME"] = home  # nothing is known of this device yet
        own = Renderer()
        surface = Surface(own.gpu, options.size)
        for count, order in product(options.counts, ORDERS):
            pose = Pose(0, 0.0, "sphere", even_sphere(count, order))
            for name, passes in product(sorted(backends()), PASSES):
                if {"instancing", "passes"} <= {p.name for p in backends()[name].parameters}:
                    try:
                        row = _passes(own, Request(pose, CAMERA, name), passes, surface, options.rounds)
                    except (Scan4DError, ImportError) as error:
                        print(f"{name}, {passes}: left out: {error}", file=sys.stderr)
                        continue
                    known = [ms for title, ms in row.items() if isinstance(ms, float)]
                    is_slow = row.get(str(row["auto takes"]), np.inf) > _SLOWER * min(known, default=np.inf)
                    slow.append(bool(known) and is_slow)
                    yield {"points": count, "order": order, **row}
    if any(slow):
        raise Failed(f"auto takes a slower value in {sum(slow)} of {len(slow)} cases")


def _passes(own: Renderer, seen: Request, passes: str, surface: Surface, rounds: int) -> Row:
    """Medians of each value, ms; those that the driver does not compile are left out."""
    drawn_by = backends()[str(seen.backend)]

    def request(feed: str) -> Request:
        values = drawn_by.params({"instancing": feed, "passes": passes})
        return replace(seen, params=values, look=Look(light="flat", quality="fast"))

    draw(own, request("auto"), surface)
    row: Row = {
        "renderer": drawn_by.name,
        "passes": passes,
        "auto takes": surface.stats.chosen.get("instancing", ""),
    }
    (declared,) = (p for p in drawn_by.parameters if p.name == "instancing")
    times: dict[str, list[float]] = {feed: [] for feed in declared.choices if feed != "auto"}
    for turn in range(rounds + 1):
        for feed in list(times):
            try:
                (found,) = pass_ms(own, [request(feed)], surface)
            except Scan4DError:
                del times[feed]
                continue
            if turn:
                times[feed].append(sum(ms for part, ms in found.items() if part != _SHADING))
    return row | {feed: float(np.median(each)) if (each := times.get(feed)) else None for feed in FEEDS[1:]}


EXPERIMENT = Script(
    [splats, chosen],
    {
        "counts": [100_000, 1_000_000],
        "size": (1920, 1280),
        "rounds": 5,
        "away": 1.0,
        "feeds": [],
        "set": [],
    },
)
