"""Tables III and IV: what is counted as in the paper, and that the stand-ins' octrees are like its own."""

from __future__ import annotations

from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from experiments.slomp_2014 import octrees, scans

from viewer.backends import backend
from viewer.bench.baselines import FLOOR
from viewer.bench.plan import Group
from viewer.bench.report.results import Row
from viewer.bench.run import Bench, BenchSettings
from viewer.drawing.renderer import Renderer
from viewer.scan.octree.cube import Cube

SETTINGS = BenchSettings(size=(96, 64), views=2, repeat=1)
HORSE = scans.scans()[4]


@pytest.fixture(scope="module")
def bench(renderer: Renderer, data_dir: Path) -> Bench:
    return Bench(renderer, replace(SETTINGS, data=data_dir))


@pytest.fixture(scope="module")
def rows(bench: Bench) -> list[Row]:
    return list(octrees.build_and_cut(bench, [HORSE]))


def nodes_by_level(bench: Bench, view: int) -> tuple[list[int], int]:
    """How many octants of a pose hold a point, plainly, level by level; how many positions there are."""
    cloud = bench.seen(bench.subject(Group(HORSE.scene, (), HORSE.points)), view)[0].pose.cloud
    low, edge = Cube.of(cloud)
    places = cloud.positions.astype(np.float64) + (cloud.origin - low)
    cells = (np.floor(places / edge * 2**level) for level in range(11))
    return [len(np.unique(each, axis=0)) for each in cells], len(np.unique(cloud.positions, axis=0))


def test_the_papers_nodes_are_inner_nodes() -> None:
    """A level deeper, its leaves are inner nodes; rounded means differ by one at most."""
    for by_delta in scans.PAPER["octrees"].values():
        for deeper, tree in pairwise(by_delta):
            assert deeper["depth"] == tree["depth"] + 1
            assert abs(tree["nodes"] + tree["leaves"] - deeper["nodes"]) <= 1


@pytest.mark.slow
def test_trees_are_counted_as_in_the_paper(bench: Bench, rows: list[Row]) -> None:
    """Inner nodes and leaves, means over the poses, at the first level whose loss is no more than delta."""
    assert [row["delta"] for row in rows] == list(octrees.DELTAS)
    poses = [nodes_by_level(bench, view) for view in range(SETTINGS.views)]
    for row in rows:
        depths, nodes, leaves, losses = [], [], [], []
        for counts, distinct in poses:
            loss = [1 - count / distinct for count in counts]
            depth = next(level for level in range(11) if loss[level] <= row["delta"] / 100)
            depths.append(depth)
            nodes.append(sum(counts[:depth]))
            leaves.append(counts[depth])
            losses.append(loss[depth])
        assert row["depths"] == sorted(set(depths))
        assert (row["nodes"], row["leaves"]) == (np.mean(nodes), np.mean(leaves))
        assert row["loss"] == pytest.approx(np.mean(losses), rel=1e-12)


@pytest.mark.slow
def test_every_work_has_its_times_beside_the_sort(rows: list[Row]) -> None:
    for row in rows:
        assert (row["scene"], row["n"], row["poses"]) == (HORSE.scene, HORSE.points, SETTINGS.views)
        assert row["ms"].keys() == set(octrees.WORKS)
        assert row["sorts"].keys() == set(octrees.WORKS) - {octrees.SORT}
        assert all(0 < each["p5"] <= each["p95"] for each in (row["ms"] | row["sorts"]).values())
        assert row["ms"]["attributes"]["p5"] > row["ms"]["build"]["p5"]
        assert 0 < row["cut"] < row["leaves"], "a small picture tells few leaves apart"


def test_each_scan_meets_every_feed_at_the_papers_level() -> None:
    groups = [group for group in octrees.groups() if group.sweep == "instancing"]
    assert [(group.scene, group.count) for group in groups] == [
        (scan.scene, scan.points) for scan in scans.scans()
    ]
    levels = [group.contenders[1].params.depth for group in groups]
    assert levels == [10, 10, 11, 10, 10, 10]
    usual = asdict(backend("voxels").params())
    for group, level in zip(groups, levels, strict=True):
        assert not group.judged
        floor, *drawn = group.contenders
        assert floor.backend == FLOOR
        assert [contender.params.instancing for contender in drawn] == scans.feeds_of("voxels")
        for contender in drawn:
            whole = {"stop": "depth", "depth": level, "least": 0.0, "pixel_threshold": 0.25}
            whole |= {"shape": "cubes"}
            feed = {"instancing": contender.params.instancing}
            assert asdict(contender.params) == usual | whole | feed


def test_levels_are_judged_with_both_kinds_of_cubes() -> None:
    groups = [group for group in octrees.groups() if group.sweep == "max_depth"]
    assert "demo" in {group.scene for group in groups}
    for group in groups:
        assert group.judged
        drawn = [(contender.params.least, contender.params.max_depth) for contender in group.contenders]
        usual = backend("voxels").params().least
        assert drawn == [(least, level) for least in (0.0, usual) for level in octrees.LEVELS]


def test_what_is_walked_is_judged_and_has_frames(renderer: Renderer) -> None:
    levels = next(group for group in octrees.groups() if group.judged)
    assert Bench(renderer, SETTINGS).walks(levels) == 2
    assert Bench(renderer, replace(SETTINGS, frames=0)).walks(levels) == 0


def test_stand_ins_have_trees_like_the_papers(rows: list[Row]) -> None:
    """Depths within one of its own, no loss beyond delta, and nodes."""
    ours = {row["delta"]: row for row in rows}
    for tree in scans.PAPER["octrees"][HORSE.name]:
        row = ours[tree["delta_percent"]]
        assert all(abs(depth - tree["depth"]) <= 1 for depth in row["depths"])
        assert row["loss"] <= row["delta"] / 100
        assert row["nodes"] > 0


@pytest.mark.slow
def test_finer_levels_are_nearer_the_truth(renderer: Renderer) -> None:
    """As long as cubes close the surface: less lies beyond the outline, fewer depths are far off."""
    levels = next(group for group in octrees.groups() if group.judged and group.scene == "demo")
    coarse, *_, fine = (one for one in levels.contenders if one.params.least and one.params.max_depth <= 9)
    bench = Bench(renderer, replace(SETTINGS, size=(192, 128), frames=0))
    errors = [row["errors"] for row in bench.measure(replace(levels, contenders=(coarse, fine)))]
    assert all(row["hole_percent"] <= 0.1 for row in errors)
    for name in ("spill_percent", "depth_p95_px"):
        assert errors[1][name] < errors[0][name] / 1.5
