"""How fast range views come to the GPU, and how fast shaders go through their samples. Prints a table.

    python tests/speed/range_samples.py [--size 3000x4500] [--rounds 5] [--distorted] [--measured]

One view of a ball that fills three quarters of its pixels. Wall time, and processor time of all threads,
which other work on the machine changes less.
"""

from __future__ import annotations

import argparse
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path

import moderngl
import numpy as np

from viewer.gpu.bindings import Storage, Texture
from viewer.gpu.context import Gpu, headless
from viewer.gpu.range_samples import RangeSamples
from viewer.scan.range_view import RangeView
from viewer.view import View

PASS = str(Path(__file__).resolve().parent / "shaders" / "range_pass.comp")
WORK = ("depth", "depth, as a texture", "place", "place of what is there", "normal")
RUNS = (1, 16)


def ball(width: int, height: int, distorted: bool, measured: bool) -> RangeView:
    """The view."""
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


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Seconds: wall, and processor."""
    wall, processor = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - wall, time.process_time() - processor


def built(gpu: Gpu, view: RangeView) -> tuple[RangeSamples, dict[str, tuple[float, float]]]:
    """The samples, and what each kind of step took."""
    taken: dict[str, tuple[float, float]] = defaultdict(lambda: (0.0, 0.0))

    def add(name: str, more: tuple[float, float]) -> None:
        taken[name] = (taken[name][0] + more[0], taken[name][1] + more[1])

    made: list[RangeSamples] = []
    add("room", timed(lambda: made.append(RangeSamples(gpu, [view]))))
    names = {"_write": "upload", "_reduce": "levels", "_bound": "tiles"}
    for step in made[0]._steps:
        add(names[step.func.__name__], timed(step))  # type: ignore[attr-defined]
    return made[0], taken


def passes(
    gpu: Gpu, view: RangeView, samples: RangeSamples, rounds: int
) -> Iterator[tuple[str, int, float, float]]:
    """(what is done, samples of an invocation, seconds, of processors): the least of some turns."""
    height, width = view.depth.shape
    image = gpu.ctx.texture((width, height), 1, view.depth.tobytes(), dtype="f4")
    image.filter = (moderngl.NEAREST, moderngl.NEAREST)
    sums = gpu.ctx.buffer(reserve=4 * width * height)
    samples.bind(View((1680, 1050), np.zeros(3), np.eye(3), np.zeros(3), 1000.0, 0.1, 1e3, 1e3, True))
    for (number, name), run in ((work, run) for work in enumerate(WORK) for run in RUNS):
        program = gpu.compute(PASS, {**samples.defines, "WORK": number})
        image.use(Texture.PICTURE)
        sums.bind_to_storage_buffer(Storage.WORDS)
        gpu.set(program, run=run)

        def go(program: moderngl.ComputeShader = program, run: int = run) -> None:
            gpu.dispatch(program, height * -(-width // run))
            gpu.ctx.finish()

        turns = [timed(go) for _ in range(rounds)]
        yield name, run, *(min(each) for each in zip(*turns, strict=True))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--size", default="3000x4500")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--distorted", action="store_true")
    parser.add_argument("--measured", action="store_true")
    args = parser.parse_args()
    width, height = map(int, args.size.split("x"))
    gpu, view = headless(), ball(width, height, args.distorted, args.measured)
    built(gpu, view)[0].release()  # programs are built
    gpu.collect()
    samples, taken = built(gpu, view)
    print(f"{gpu.device}: {samples.count / 1e6:.1f} M samples, {samples.bytes_per_sample:.1f} bytes each")
    for name, (wall, processor) in taken.items():
        print(f"{name:>8}: {wall * 1e3:6.0f} ms, processor {processor * 1e3:6.0f} ms")
    for name, run, *seconds in passes(gpu, view, samples, args.rounds):
        wall, processor = (samples.count / each / 1e6 for each in seconds)
        print(f"{name}, {run} of a row: {wall:.0f} M samples/s, {processor:.0f} for a second of a processor")


if __name__ == "__main__":
    main()
