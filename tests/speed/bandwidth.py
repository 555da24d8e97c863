"""How near points come to what the memory of this device carries, in one run. Prints a table.

    python tests/speed/bandwidth.py [--counts 1000000 10000000 100000000] [--size 1920x1280] [--rounds 7]
                                    [--megabytes 256] [--data FOLDER]

The bandwidth is that of a copy of a buffer to another, read and written bytes counted, by a timer query
(between finishes on software drivers), the best of some rounds, by the driver or by a shader: whichever is
faster. Points need to read each position twice at
the least, 12 bytes a time, once for its depth and once for its row: `bound` is how long that takes at that
bandwidth, and `ratio` how many times as long the renderer's passes take, shading left out. A number of points
for which there is no memory is left out with the reason. --data: also written there, into
bandwidth-DEVICE.json.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from device import write_rows

from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.drawing.timing import draw, pass_ms
from viewer.errors import Scan4DError
from viewer.gpu.bindings import Storage
from viewer.gpu.context import Gpu
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

COPY = str(Path(__file__).resolve().parent / "shaders" / "copy.comp")
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


def measured(renderer: Renderer, count: int, surface: Surface, rounds: int) -> dict[str, Any]:
    """A row of the table. Raises Scan4DError, MemoryError."""
    if count > renderer.gpu.max_points:
        raise MemoryError(f"the driver takes {renderer.gpu.max_points:,} points at most")
    if count * _HOST_BYTES > free_bytes():
        raise MemoryError(f"{free_bytes() / 1e9:.1f} GB of memory are free")
    pose = Pose(0, 0.0, "ball", ball(count))
    camera = Camera(eye=(0.3, 0.5, 4.0), target=(0, 0, 0), fov_y=30)
    request = Request(pose, camera, "points", None, Look(light="flat", quality="fast"))
    draw(renderer, request, surface)
    found = pass_ms(renderer, request, surface, rounds)
    passes = {name: round(float(np.median([each[name] for each in found])), 3) for name in found[0]}
    return {
        "n": count,
        "ms": sum(ms for name, ms in passes.items() if name != _SHADING),
        "passes": passes,
    }


def main() -> None:
    arguments = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    arguments.add_argument("--counts", type=int, nargs="+", default=[1_000_000, 10_000_000, 100_000_000])
    arguments.add_argument("--size", default="1920x1280")
    arguments.add_argument("--rounds", type=int, default=7)
    arguments.add_argument("--megabytes", type=int, default=256)
    arguments.add_argument("--data", type=Path)
    options = arguments.parse_args()
    width, height = (int(n) for n in options.size.split("x"))

    renderer = Renderer()
    surface = Surface(renderer.gpu, (width, height))
    bandwidth = copied_bytes_a_second(renderer.gpu, options.megabytes * 2**20, options.rounds)
    print(f"{renderer.gpu.device}, {width}x{height}, {renderer.gpu.timers.kind}, median of {options.rounds}")
    print(f"copies {bandwidth / 1e9:.1f} GB/s, of {options.megabytes} MB")
    print(f"{'points':>12} {'ms':>9} {'bound':>9} {'ratio':>7}")
    rows = []
    for count in options.counts:
        try:
            row = measured(renderer, count, surface, options.rounds)
        except (Scan4DError, MemoryError) as error:
            print(f"{count:12,} left out: {error}", flush=True)
            continue
        bound = _READ * count / bandwidth * 1e3
        rows.append({**row, "bound_ms": round(bound, 3), "ratio": round(row["ms"] / bound, 2)})
        told = ", ".join(f"{name} {ms:.2f}" for name, ms in row["passes"].items())
        print(f"{count:12,} {row['ms']:9.2f} {bound:9.2f} {row['ms'] / bound:7.1f}  {told}", flush=True)
    if options.data:
        told = {"size": [width, height], "rounds": options.rounds, "bytes_a_second": bandwidth}
        print(write_rows(options.data, "bandwidth", renderer.gpu, rows, **told))


if __name__ == "__main__":
    main()
