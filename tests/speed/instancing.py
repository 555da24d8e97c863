"""Whether `instancing=auto` takes the fastest way on this device. Prints a table.

    python tests/speed/instancing.py [--counts 100000 1000000] [--size 1920x1280] [--rounds 5] [--data FOLDER]

A sphere that fills half of the picture with radii of 1.5 times the spacing, in random order and in that of a
scanner, by each value that the parameter has, for each renderer that has it, in one pass and in two. Times
are those of the renderer's passes, without shading, by timer queries where the driver's tell the truth (else
between finishes); ways take turns, medians. `auto` decides as for a user who starts for the first time. Exit
status 1 where it takes a way that is slower than the fastest by more than a tenth. --data: also written
there, into instancing-DEVICE.json.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from device import write_rows
from splats import ORDERS, sphere

from viewer.backends import backends
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.drawing.timing import draw, pass_ms
from viewer.errors import Scan4DError
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose

PASSES = ("one", "two")
_SHADING = "shade"  # the pass that all pictures have
_SLOWER = 1.1  # than the fastest, that "auto" may be


def measured(
    renderer: Renderer, name: str, passes: str, pose: Pose, surface: Surface, rounds: int
) -> dict[str, Any]:
    """A row: ms of each way, and what "auto" takes. Raises Scan4DError where it cannot be drawn."""
    backend = backends()[name]
    choices = next(p.choices for p in backend.parameters if p.name == "instancing")
    assert choices is not None
    camera = Camera(eye=(0.3, 0.5, 2.6), target=(0, 0, 0), fov_y=46)

    def request(way: str) -> Request:
        values = backend.params({"instancing": way, "passes": passes})
        return Request(pose, camera, name, values, Look(light="flat", quality="fast"))

    draw(renderer, request("auto"), surface)
    chosen = surface.stats.chosen.get("instancing", "")
    times: dict[str, list[float]] = {way: [] for way in choices if way != "auto"}
    for turn in range(rounds + 1):
        for way in list(times):
            try:
                (found,) = pass_ms(renderer, request(way), surface, 1)
            except Scan4DError as error:  # that the driver does not compile, say
                print(f"{name}, {passes}, {way}: {error}", flush=True)
                del times[way]
                continue
            if turn:
                times[way].append(sum(ms for each, ms in found.items() if each != _SHADING))
    medians = {way: round(float(np.median(values)), 3) for way, values in times.items()}
    return {"backend": name, "passes": passes, "chosen": chosen, "ms": medians}


def verdict(row: dict[str, Any]) -> str:
    """How the way that was taken compares with the fastest; empty where it is that, or as good."""
    ms, chosen = row["ms"], row["chosen"]
    if chosen not in ms:  # a mixture, which no single way is
        return ""
    fastest = min(ms, key=lambda way: ms[way])
    return (
        ""
        if ms[chosen] <= _SLOWER * ms[fastest]
        else f"{fastest} is {ms[chosen] / ms[fastest]:.2f} times as fast"
    )


def main() -> int:
    """0 where "auto" takes the fastest everywhere."""
    arguments = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    arguments.add_argument("--counts", type=int, nargs="+", default=[100_000, 1_000_000])
    arguments.add_argument("--size", default="1920x1280")
    arguments.add_argument("--rounds", type=int, default=5)
    arguments.add_argument("--data", type=Path)
    options = arguments.parse_args()
    width, height = (int(n) for n in options.size.split("x"))
    names = [
        name for name, each in backends().items() if any(p.name == "instancing" for p in each.parameters)
    ]
    rows = []
    with tempfile.TemporaryDirectory() as cache:
        os.environ["XDG_CACHE_HOME"] = cache  # where nothing is remembered
        renderer = Renderer()
        surface = Surface(renderer.gpu, (width, height))
        gpu = renderer.gpu
        print(f"{gpu.device}, {width}x{height}, {gpu.timers.kind}, median of {options.rounds}, ms")
        for count in options.counts:
            for order in ORDERS:
                pose = Pose(0, 0.0, "sphere", sphere(count, order))
                for name in names:
                    for passes in PASSES:
                        case = f"{count:10,} {order:8} {name:12} {passes:4}"
                        try:
                            row = measured(renderer, name, passes, pose, surface, options.rounds)
                        except (Scan4DError, ImportError) as error:
                            print(f"{case} left out: {error}", flush=True)
                            continue
                        rows.append({"n": count, "order": order, **row})
                        cells = " ".join(f"{way} {ms:.2f}" for way, ms in row["ms"].items())
                        print(
                            f"{case} {cells}; auto takes {row['chosen'] or 'none'}", verdict(row), flush=True
                        )
    if options.data:
        print(
            write_rows(
                options.data, "instancing", renderer.gpu, rows, size=[width, height], rounds=options.rounds
            )
        )
    slower = sum(bool(verdict(row)) for row in rows)
    print(f"auto takes a slower way in {slower} of {len(rows)} cases")
    return int(slower > 0)


if __name__ == "__main__":
    sys.exit(main())
