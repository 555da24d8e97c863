"""What Slomp 2014 measured of octrees, and the same here: Tables III and IV, and levels of detail (Fig. 6).

Scans of the same counts of points stand in for the paper's (`slomp`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ....backends import backend
from ....backends.voxels import sight_of
from ....camera import Camera
from ....scan.octree.build import Stop, build, sort_points
from ....scan.octree.cube import Cube, Grid
from ....scan.octree.octree import Octree
from ....scan.octree.traverse import Sight, Traversal
from ....scan.points import PointCloud
from ....view import View
from ...plan import Contender, Group
from ...report.results import Row, spread
from ...run import Bench, undisturbed
from . import surfels as slomp
from .surfels import Scan

BACKEND, LEVEL = "voxels", "max_depth"
DELTAS = (2, 5, 10, 50)  # percent; 5 is the paper's advice, which it has no figures of
LEVELS = range(6, 12)
CUBE = "least"  # the parameter: how large a cube is at least
SORT = "sort"  # what all else is compared with
WORKS = ("build", "attributes", "cut", "leaves", SORT)

_ROUNDS = 5  # for each repeat of a draw, as these take less
_DEPTH = 10  # of the demo in Table IV
_LEVEL_SCENES = ("demo", "dragon")
# All leaves, as cubes that are as large as they are.
_LEAVES = {"stop": "depth", "shape": "cubes", CUBE: 0.0, "pixel_threshold": 0.25}


def groups() -> list[Group]:
    """Table IV: a group for each of its scans and the demo. Then scenes at one level after the other."""
    feeds = [slomp.by_feed(scan, BACKEND, {**_LEAVES, "depth": depth_of(scan)}) for scan in slomp.scans()]
    edges = (0.0, getattr(backend(BACKEND).params(), CUBE))  # octants, and what closes the surface
    params = (
        backend(BACKEND).params({**_LEAVES, "depth": max(LEVELS), CUBE: edge, LEVEL: level})
        for edge, level in product(edges, LEVELS)
    )
    levels = tuple(Contender(BACKEND, each, LEVEL) for each in params)
    return [*feeds, *(Group(scene, levels, sweep=LEVEL) for scene in _LEVEL_SCENES)]


def depth_of(scan: Scan) -> int:
    """The level of the leaves that Table IV draws."""
    return int(slomp.paper()["voxels_ms"][scan.name]["depth"]) if scan.name else _DEPTH


@dataclass
class _Found:
    """Measurements of one scan at one delta. trees, cut: a value for each pose; ms: one for each round."""

    trees: list[Octree] = field(default_factory=list)
    cut: list[int] = field(default_factory=list)
    ms: dict[str, list[float]] = field(default_factory=lambda: {work: [] for work in WORKS})

    def row(self) -> Row:
        """Means of what trees are; spreads of times, and of how many times as long as their round's sort."""
        trees, sort = self.trees, np.array(self.ms[SORT])
        ratios = {work: np.array(self.ms[work]) / sort for work in WORKS if work != SORT}
        return {
            "poses": len(trees),
            "depths": sorted({tree.depth for tree in trees}),
            "loss": float(np.mean([tree.loss for tree in trees])),
            "nodes": float(np.mean([tree.counts[:-1].sum() for tree in trees])),
            "leaves": float(np.mean([tree.leaves for tree in trees])),
            "cut": float(np.mean(self.cut)),
            "ms": {work: spread(times) for work, times in self.ms.items()},
            "sorts": {work: spread(values) for work, values in ratios.items()},
        }


def build_and_cut(bench: Bench, scans: Sequence[Scan]) -> Iterator[Row]:
    """Table III: a row for each scan and delta, over the poses and viewpoints of the bench's views.

    All works take turns. Their times, ms of a processor: "build" without and "attributes" with colours and
    normals of every node; "cut" for a view at a pixel, "leaves" at no limit, both with centres; "sort" of
    numpy, of the same Morton codes as the points come. On one thread, for fewer than 200 000 points. Nodes
    are inner ones.
    """
    settings = bench.settings
    for scan in scans:
        subject = bench.subject(Group(scan.scene, (), count=scan.points))
        found = {delta: _Found() for delta in DELTAS}
        for view in range(settings.views):
            moment, camera = bench.seen(subject, view)
            for delta in DELTAS:
                _measure(moment.pose.cloud, camera, delta / 100, bench, found[delta])
        for delta in DELTAS:
            yield {
                "scene": subject.name,
                "scene_hash": subject.hash,
                "n": len(moment.pose.cloud),
                "delta": delta,
                "size": list(settings.size),
                "seed": settings.seed,
                **found[delta].row(),
                **bench.where(),
            }


def _measure(cloud: PointCloud, camera: Camera, delta: float, bench: Bench, found: _Found) -> None:
    """Add what is found of one pose from one viewpoint."""
    settings = bench.settings
    view = View.of(camera, settings.size, cloud.origin, cloud.bounds())
    sight = sight_of(view)
    tree = build(cloud, Stop(delta=delta), attributes=False)
    works = _works(cloud, tree, sight, Stop(delta=delta))
    found.trees.append(tree)
    found.cut.append(works["cut"]())
    with undisturbed():
        for turn in range(1 + _ROUNDS * settings.repeat):
            for name, work in works.items():
                start = time.process_time()
                work()
                if turn:  # not what it takes to begin
                    found.ms[name].append((time.process_time() - start) * 1e3)


def _works(cloud: PointCloud, tree: Octree, sight: Sight, stop: Stop) -> dict[str, Callable[[], int]]:
    """The works that are timed, by name (`WORKS`); each gives how many nodes or points there are."""
    if cloud.colors is None:  # which ones does not matter
        cloud = replace(cloud, colors=np.full((len(cloud), 4), 128, np.uint8))
    codes = _codes(cloud)
    at_a_pixel, at_no_limit = (
        Traversal(tree, sight, pixel_threshold=pixels, cull_cones=False) for pixels in (1.0, 0.0)
    )

    def cut(traversal: Traversal) -> int:
        traversal.look(sight)
        traversal.advance()
        return len(traversal.cut(cloud.origin))

    return {
        "build": lambda: build(cloud, stop, attributes=False).leaves,
        "attributes": lambda: build(cloud, stop).leaves,
        "cut": lambda: cut(at_a_pixel),
        "leaves": lambda: cut(at_no_limit),
        SORT: lambda: len(np.sort(codes)),
    }


def _codes(cloud: PointCloud) -> NDArray[np.uint64]:
    """The Morton codes that a build sorts, in the order of the points."""
    points = sort_points(cloud.positions, Grid.of(Cube.of(cloud), cloud.origin))
    codes = np.empty_like(points.codes)
    codes[points.rows] = points.codes
    return codes
