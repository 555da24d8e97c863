"""How fast range views come to the GPU: one view of a ball that fills three quarters of its pixels."""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Iterator

import numpy as np

from experiments.pictures import renderer
from experiments.script import Script
from experiments.tables import Row
from viewer.gpu.range_samples import RangeSamples
from viewer.scan.range_view import RangeView

_STEPS = {"_write": "upload", "_reduce": "levels", "_bound": "tiles"}


def ball(size: tuple[int, int], distorted: bool, measured: bool) -> RangeView:
    """The view."""
    width, height = size
    x, y = np.linspace(-1, 1, width, dtype=np.float32), np.linspace(-1, 1, height, dtype=np.float32)[:, None]
    squared = x * x + y * y
    depth = np.where(squared < 1, 3 - np.sqrt(np.maximum(1 - squared, 0)), np.float32(np.nan))
    return RangeView(
        depth=depth,
        mask=np.ones(depth.shape, bool),
        color=np.random.default_rng(0).integers(0, 256, (height, width, 3), np.uint8),
        xy=np.stack(np.broadcast_arrays(x, -y), axis=2).copy() if measured else None,
        fx=1.2 * width,
        fy=1.2 * width,
        cx=width / 2,
        cy=height / 2,
        distortion=(-0.28, 0.07, 0.002, -0.001) if distorted else (),
        world_to_camera=np.eye(4),
    )


def upload(options: Namespace) -> Iterator[Row]:
    """Wall and processor time of each kind of step. --distorted: through a wide lens; --measured: with x and
    y."""
    view, gpu = ball(options.size, options.distorted, options.measured), renderer().gpu
    for warm in (True, False):  # programs are built in the first round
        taken: dict[str, np.ndarray] = {}
        start = np.array([time.perf_counter(), time.process_time()])
        samples = RangeSamples(gpu, [view])
        taken["room"] = np.array([time.perf_counter(), time.process_time()]) - start
        for step in samples._steps:
            start = np.array([time.perf_counter(), time.process_time()])
            step()
            name = _STEPS[step.func.__name__]  # type: ignore[attr-defined]
            taken[name] = taken.get(name, 0) + np.array([time.perf_counter(), time.process_time()]) - start
        if warm:
            samples.release()
            gpu.collect()
    counts = {"samples": samples.count, "bytes a sample": f"{samples.bytes_per_sample:.1f}"}
    for name, (wall, busy) in taken.items():
        yield {"step": name, "ms": 1e3 * float(wall), "processor, ms": 1e3 * float(busy), **counts}


EXPERIMENT = Script([upload], {"size": (3000, 4500), "distorted": False, "measured": False})
