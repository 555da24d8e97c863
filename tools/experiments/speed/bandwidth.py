"""How near points come to what the memory of this device carries.

The bandwidth is that of a copy of a buffer to another, read and written bytes counted, by a timer query
(between finishes on software drivers), the best of some rounds, by the driver or by a shader: whichever is
faster. Points need to read each position twice at the least, 12 bytes a time, once for its depth and once for
its row: `bound` is how long that takes at that bandwidth, and `ratio` how many times as long the renderer's
passes take, shading left out. A number of points for which there is no memory is left out with the reason.
"""

from __future__ import annotations

import sys
import time
from argparse import Namespace
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from experiments.pictures import renderer
from experiments.script import Script
from experiments.tables import Row
from viewer.camera import Camera
from viewer.drawing.request import Request
from viewer.drawing.timing import draw, pass_ms
from viewer.errors import Scan4DError
from viewer.gpu.bindings import Storage
from viewer.gpu.context import Gpu
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

COPY = str(Path(__file__).with_name("copy.comp"))
_SHADING = "shade"
_READ = 2 * 12  # bytes of each point
_HOST_BYTES = 120  # of each point, at the most, while its arrays are made
_PIECE = 5_000_000  # points that are made at a time


def copied_bytes_a_second(gpu: Gpu, size: int, rounds: int) -> float:
    """Bytes that a copy of a buffer of so many reads and writes in a second."""
    source, target = gpu.ctx.buffer(reserve=size), gpu.ctx.buffer(reserve=size)
    source.bind_to_storage_buffer(Storage.WORDS)
    target.bind_to_storage_buffer(Storage.LIST)
    program = gpu.compute(COPY)

    def by_shader() -> None:
        gpu.dispatch(program, size // 16)

    def by_driver() -> None:
        gpu.ctx.copy_buffer(target, source)

    seconds = [took(gpu, copy) for copy in (by_shader, by_driver) for _ in range(rounds + 1)]
    for buffer in (source, target):
        buffer.release()
    return 2 * size / min(seconds)


def took(gpu: Gpu, work: Callable[[], None]) -> float:
    """Seconds."""
    if gpu.timers.kind == "query":
        query = gpu.ctx.query(time=True)
        with query:
            work()
        return query.elapsed * 1e-9
    gpu.ctx.finish()
    start = time.perf_counter()
    work()
    gpu.ctx.finish()
    return time.perf_counter() - start


def ball(count: int) -> PointCloud:
    """Points on a sphere in random order, made in pieces, without colours."""
    rng = np.random.default_rng(0)
    positions = np.empty((count, 3), np.float32)
    for first in range(0, count, _PIECE):
        piece = positions[first : first + _PIECE]
        rng.standard_normal(piece.shape, np.float32, out=piece)
        piece /= np.linalg.norm(piece, axis=1, keepdims=True)
    return PointCloud.from_arrays(positions, origin=np.zeros(3))


def free_bytes() -> float:
    """Memory that the system has to give."""
    for line in Path("/proc/meminfo").read_text().splitlines():
        if line.startswith("MemAvailable:"):
            return int(line.split()[1]) * 1024.0
    return 0.0


def passes_of(count: int, surface: Surface, rounds: int) -> Row:
    """Median time of all passes but shading, and of each, ms. Raises Scan4DError, MemoryError."""
    if count > renderer().gpu.max_points:
        raise MemoryError(f"the driver takes {renderer().gpu.max_points:,} points at most")
    if count * _HOST_BYTES > free_bytes():
        raise MemoryError(f"{free_bytes() / 1e9:.1f} GB of memory are free")
    pose = Pose(0, 0.0, "ball", ball(count))
    camera = Camera(eye=(0.3, 0.5, 4.0), target=(0, 0, 0), fov_y=30)
    request = Request(pose, camera, "points", None, Look(light="flat", quality="fast"))
    draw(renderer(), request, surface)
    found = pass_ms(renderer(), [request] * rounds, surface)
    passes = {name: round(float(np.median([each[name] for each in found])), 3) for name in found[0]}
    return {"ms": float(sum(ms for name, ms in passes.items() if name != _SHADING)), **passes}


def bandwidth(options: Namespace) -> Iterator[Row]:
    """Points beside the bound by the memory."""
    surface = Surface(renderer().gpu, options.size)
    copied = copied_bytes_a_second(renderer().gpu, options.megabytes * 2**20, options.rounds)
    for count in options.counts:
        try:
            row = passes_of(count, surface, options.rounds)
        except (Scan4DError, MemoryError) as error:
            print(f"{count:,} points are left out: {error}", file=sys.stderr)
            continue
        bound = _READ * count / copied * 1e3
        yield {
            "points": count,
            "copies, GB/s": copied / 1e9,
            "bound, ms": bound,
            "ratio": row["ms"] / bound,
            **row,
        }


EXPERIMENT = Script(
    [bandwidth],
    {"counts": [1_000_000, 10_000_000, 100_000_000], "size": (1920, 1280), "rounds": 7, "megabytes": 256},
)
