"""Octrees of Slomp 2014, then and now: Tables III and IV, levels of detail (Fig. 6), and sizes on disk.

Scans of the same counts of points replace the paper's.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from experiments.slomp_2014 import octree_sizes
from experiments.slomp_2014.scans import FEED, PAPER, Scan, by_feed, feed_tables, scans
from experiments.suite import Part, Suite, pictures, row_of
from experiments.tables import Column, Machines, Row, StoredRun, Table, code, columns, spaced
from viewer.backends import backend
from viewer.backends.voxels.cuts import sight_of
from viewer.bench.plan import Contender, Group
from viewer.bench.report.page import three_digits
from viewer.bench.report.results import spread
from viewer.bench.run import Bench, undisturbed
from viewer.bench.scenes import catalog
from viewer.camera import Camera
from viewer.scan.octree.build import Stop, build, sort_points
from viewer.scan.octree.cube import Cube, Grid
from viewer.scan.octree.octree import Octree
from viewer.scan.octree.traverse import Sight, Traversal
from viewer.scan.points import PointCloud
from viewer.view import View

BACKEND, LEVEL = "voxels", "max_depth"
DELTAS = (2, 5, 10, 50)  # percent; 5 is the paper's advice, which it has no figures of
LEVELS = range(6, 12)
CUBE = "least"  # the parameter: how large a cube is at least
SORT = "sort"  # what all else is compared with
WORKS = ("build", "attributes", "cut", "leaves", SORT)

_PAPERS = {"build": "build_ms", "cut": "traverse_ms"}  # the works that the paper times
_ERRORS = {
    "hole_percent": "holes, %",
    "through_percent": "through, %",
    "spill_percent": "spill, %",
    "depth_median_px": "depth, median px",
    "depth_p95_px": "depth, 95 % px",
    "normal_mean": "normal, °",
    "psnr": "PSNR, dB",
}
_ROUNDS = 5  # for each repeat of a draw, as these take less
_DEPTH = 10  # of the demo in Table IV
_LEVEL_SCENES = ("demo", "dragon")
# All leaves, as cubes that are as large as they are.
_LEAVES = {"stop": "depth", "shape": "cubes", CUBE: 0.0, "pixel_threshold": 0.25}


def groups() -> list[Group]:
    """Table IV: a group for each of its scans and the demo. Then scenes at one level after the other."""
    feeds = [by_feed(scan, BACKEND, {**_LEAVES, "depth": depth_of(scan)}) for scan in scans()]
    edges = (0.0, getattr(backend(BACKEND).params(), CUBE))  # octants, and what closes the surface
    params = (
        backend(BACKEND).params({**_LEAVES, "depth": max(LEVELS), CUBE: edge, LEVEL: level})
        for edge, level in product(edges, LEVELS)
    )
    levels = tuple(Contender(BACKEND, each, LEVEL) for each in params)
    return [*feeds, *(Group(scene, levels, sweep=LEVEL) for scene in _LEVEL_SCENES)]


def depth_of(scan: Scan) -> int:
    """The level of the leaves that Table IV draws."""
    return int(PAPER["voxels_ms"][scan.name]["depth"]) if scan.name else _DEPTH


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


def available_trees(bench: Bench) -> Iterator[Row]:
    """The rows of Table III of the scans that are there."""
    missing = catalog.scene_names(bench.settings.data)
    return build_and_cut(bench, [scan for scan in scans() if not missing[scan.scene]])


def build_and_cut(bench: Bench, measured: Sequence[Scan]) -> Iterator[Row]:
    """Table III: a row for each scan and delta, over the poses and viewpoints of the bench's views.

    All works take turns. Their times, ms of a processor: "build" without and "attributes" with colours and
    normals of every node; "cut" for a view at a pixel, "leaves" at no limit, both with centres; "sort" of
    numpy, of the same Morton codes as the points come. On one thread, for fewer than 200 000 points. Nodes
    are inner ones.
    """
    settings = bench.settings
    for scan in measured:
        subject = bench.subject(Group(scan.scene, (), count=scan.points))
        found = {delta: _Found() for delta in DELTAS}
        for view in range(settings.views):
            moment, camera = bench.seen(subject, view)
            for delta in DELTAS:
                _measure(moment.pose.cloud, camera, delta / 100, bench, found[delta])
        for delta in DELTAS:
            named = {"scene": subject.name, "n": len(moment.pose.cloud), "delta": delta}
            yield row_of(bench, **named, **found[delta].row())


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


# --- tables ---------------------------------------------------------------------------


def _stored_trees(rows: Sequence[Row]) -> Iterator[Row]:
    """Of each row the means, and the medians of times."""
    for row in rows:
        names = ("device", "scene", "n", "delta", "poses", "depths", "loss", "nodes", "leaves")
        medians = {kind: {work: row[kind][work]["median"] for work in row[kind]} for kind in ("ms", "sorts")}
        yield {**{name: row[name] for name in names[1:]}, **medians}


def _tree_lines(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Table III: of each scan and delta the paper's line, then those of the runs."""
    for scan, delta in product(scans(), DELTAS):
        named = {"scan": scan.title, "δ": f"{delta} %"}
        for line in PAPER["octrees"].get(scan.name, []):
            if line["delta_percent"] == delta:
                loss = line["loss_percent"]
                yield {
                    **named, **line, "points": scan.points, "machine": "2014",
                    "loss": f"{loss:.{2 if loss < 10 else 1}f} %", "depth": str(line["depth"]),
                    "times": {work: f"{line[name]:#.4g}" for work, name in _PAPERS.items()},
                }  # fmt: skip
        for each in runs:
            for row in scan.rows(each, "trees"):
                if row["delta"] == delta:
                    depths = dict.fromkeys((min(row["depths"]), max(row["depths"])))
                    times = {w: f"{three_digits(row['ms'][w])} ({row['sorts'][w]:.2f})" for w in WORKS[:-1]}
                    yield {
                        **named, **row, "points": row["n"], "machine": each["device"],
                        "loss": f"{three_digits(100 * row['loss'])} %",
                        "depth": " to ".join(map(str, depths)),
                        "times": {**times, SORT: three_digits(row["ms"][SORT])},
                    }  # fmt: skip


def _level_lines(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Time against error, level by level."""
    for each in runs:
        for row in each["levels"]:
            busy = float(np.median(row["busy_ms"])) / each["processors"]
            yield {
                **row,
                "cubes": "closed" if row["least"] else "octants",
                "machine": each["device"],
                "ms": float(np.median(row["gpu_ms"])),
                "busy": busy if each["timer"] == "finish" else None,
            }


def _sizes(runs: Sequence[StoredRun]) -> list[Row]:
    return next((each["sizes"] for each in runs if each["sizes"]), [])


def _size_columns(rows: Sequence[Row]) -> list[Column]:
    """Bits a point by each method."""
    return [
        Column("scene", left=True), Column("points"), Column("stop", left=False), Column("depth", form="{}"),
        Column("leaves"), Column("loss", lambda row: f"{100 * row['loss']:.1f} %"),
        Column("D1, dB", "psnr", "{:.1f}"), *_bits_columns(rows[0]["bits"] if rows else ()),
        Column("encode, M/s", "speeds.encode", "{:.2f}"), Column("decode, M/s", "speeds.decode", "{:.2f}"),
    ]  # fmt: skip


def _bits_columns(methods: Iterable[str]) -> list[Column]:
    return [Column(method, f"bits.{method}", "{:.2f}") for method in methods]


def _time(title: str, work: str) -> Column:
    return Column(title, lambda row: row["times"].get(work, ""))


EXPERIMENT = Suite(
    page="octree-tables.md",
    parts={
        "rows": pictures(params={FEED: "feed"}, sweeps=[FEED]),
        "trees": Part(_stored_trees, available_trees),
        "levels": pictures(_ERRORS, {CUBE: CUBE, LEVEL: "level"}, sweeps=[LEVEL]),
        "sizes": Part(
            tuple(octree_sizes.Sizes.__annotations__),
            lambda bench: map(asdict, octree_sizes.measure(bench.settings.data)),
        ),
    },
    tables=[
        Table(
            "trees",
            [
                Column("scan", left=True), Column("points"), Column("δ"), Column("machine", left=True),
                Column("loss"), Column("depth", left=False), Column("nodes", form=spaced),
                Column("leaves", form=spaced),
                _time("build", "build"), _time("with attributes", "attributes"), _time("cut", "cut"),
                _time("cut to leaves", "leaves"), _time("`numpy.sort`", SORT),
            ],
            _tree_lines,
            merged=2,
        ),
        *feed_tables("voxels_ms", lambda scan: f"{scan.title}, level {depth_of(scan)}"),
        Table(
            "levels",
            [
                code("scene"), Column("cubes"), Column("machine"), Column("level", form="{}"), Column("ms"),
                Column("its processors, ms", "busy"), *columns("errors", _ERRORS),
            ],
            _level_lines,
            merged=3,
        ),
        Table("sizes", _size_columns, _sizes),
        Machines(BACKEND, PAPER),
    ],
    groups=lambda *_: groups(),
    own=BACKEND,
    libraries=("DracoPy",),
)  # fmt: skip
