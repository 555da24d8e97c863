"""How fast octrees are built and cut, beside numpy's sort of the same Morton codes. Prints tables.

    python tests/speed/octree.py [--counts 88315 1000000 10000000] [--rounds 15] [--data DIR]

All of a row is measured in turns, so that a change of the machine's speed hits all alike: wall and
processor milliseconds, medians, and the least wall time in brackets. Clouds are even points of a sphere in
random order with normals and colours, or the stand-ins of Slomp 2014's scans where the folder of real data is
named; those up to 200 000 points are built by one thread. Traversal is of a view 1920x1280 that shows all, by
default with and without cones, its buffer of nodes included.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from viewer.bench.papers.slomp_2014 import surfels as slomp
from viewer.bench.scenes import samples
from viewer.bench.scenes.catalog import subject
from viewer.camera import Camera
from viewer.scan.octree.build import Stop, build, sort_points
from viewer.scan.octree.cube import Cube, Grid
from viewer.scan.octree.traverse import Sight, Traversal
from viewer.scan.points import PointCloud

SIZE = (1920, 1280)
DELTAS = (0.02, 0.1, 0.5)


def sphere(count: int) -> PointCloud:
    """Even points in random order, coloured by position."""
    points = samples.cloud(samples.on_sphere, count)
    order = np.random.default_rng(0).permutation(count)
    positions = points.positions[order]
    assert points.normals is not None
    return PointCloud.from_arrays(
        positions, normals=points.normals[order], colors=np.clip(positions / 2 + 0.5, 0, 1), origin=[0, 0, 0]
    )


def sight_of(cloud: PointCloud) -> Sight:
    """All of the cloud in the picture."""
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=SIZE[0] / SIZE[1])
    extent = 2 * math.tan(math.radians(camera.fov_y) / 2)
    near, far = camera.clip_range()
    return Sight(np.array(camera.eye), camera.rotation(), SIZE[1] / extent, SIZE, near, far, True)


def turns(steps: dict[str, Callable[[], object]], rounds: int) -> dict[str, str]:
    """'median wall / processor [least wall]' milliseconds of each step."""
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in steps}
    for turn in range(rounds + 1):
        for name, step in steps.items():
            wall, cpu = time.perf_counter(), time.process_time()
            step()
            if turn:
                times[name].append((time.perf_counter() - wall, time.process_time() - cpu))
    return {
        name: "{:.2f} / {:.2f} [{:.2f}]".format(*1e3 * np.median(t, axis=0), 1e3 * min(t)[0])
        for name, t in times.items()
    }


def peak_of(step: Callable[[], object]) -> float:
    """Megabytes that a step takes at most, its result included; NaN where the system does not tell."""
    if sys.platform != "linux":
        return math.nan
    Path("/proc/self/clear_refs").write_text("5")  # begins the peak anew

    def status(field: str) -> int:
        lines = Path("/proc/self/status").read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith(field))

    before = status("VmRSS")
    result = step()
    del result
    return (status("VmHWM") - before) * 1024 / 1e6


def measure(name: str, cloud: PointCloud, delta: float, rounds: int) -> None:
    """Print one row."""
    stop, grid = Stop(delta=delta), Grid.of(Cube.of(cloud), cloud.origin)
    codes = np.empty(len(cloud), np.uint64)
    codes[sort_points(cloud.positions, grid).rows] = sort_points(cloud.positions, grid).codes
    peak = peak_of(lambda: build(cloud, stop, attributes=False))
    tree = build(cloud, stop)
    sight = sight_of(cloud)
    cuts = {cones: Traversal(tree, sight, cull_cones=cones) for cones in (True, False)}

    def cut(cones: bool) -> int:
        cuts[cones].look(sight)
        cuts[cones].advance()
        return len(cuts[cones].cut(cloud.origin))

    result = turns(
        {
            "numpy.sort of the codes": lambda: np.sort(codes),
            "codes and rows sorted": lambda: sort_points(cloud.positions, grid),
            "built": lambda: build(cloud, stop, attributes=False),
            "built with colours, normals": lambda: build(cloud, stop),
            "cut": lambda: cut(True),
            "cut without cones": lambda: cut(False),
        },
        rounds,
    )
    print(
        f"{name}, {len(cloud):,} points, delta {delta:.0%}: loss {tree.loss:.2%}, depth {tree.depth}, "
        f"{tree.counts[:-1].sum():,} inner nodes, {tree.leaves:,} leaves, {cut(True):,} and {cut(False):,} "
        f"cut; peak {peak:.0f} MB, {peak / codes.nbytes * 1e6:.2f} times the codes"
    )
    for step, figures in result.items():
        print(f"    {step:30}{figures:>34}", flush=True)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--counts", type=int, nargs="+", default=[88_315, 1_000_000, 10_000_000])
    arguments.add_argument("--rounds", type=int, default=15)
    arguments.add_argument("--data", type=Path)
    options = arguments.parse_args()
    wall = time.perf_counter()
    build(sphere(100))
    print(f"first tree after {time.perf_counter() - wall:.2f} s of compiling or reading the cache")
    for count in options.counts:
        measure("sphere", sphere(count), 0.02, max(3, min(options.rounds, 10**8 // count)))
    for scan in slomp.scans() if options.data else []:
        cloud = subject(scan.scene, options.data, count=scan.points).moment(0).pose.cloud
        for delta in DELTAS:
            measure(scan.scene, cloud, delta, options.rounds)


if __name__ == "__main__":
    main()
