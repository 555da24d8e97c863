"""The paper's figures as it prints them, and what stands in for its scans."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import pytest
from experiments.slomp_2014 import feeds, scans

from viewer.backends import backend
from viewer.bench.run import BenchSettings
from viewer.bench.scenes import catalog

COUNTS = {
    "baseball": 88_315,
    "basketball": 87_003,
    "kick": 101_931,
    "soccer (juggle)": 92_352,
    "soccer (shoot)": 60_976,
}


def test_the_figures_agree_among_themselves() -> None:
    """Table III prints a loss for each octree, which is what its leaves lack of the points in Table I."""
    paper = scans.PAPER
    assert {name: dataset["points"] for name, dataset in paper["datasets"].items()} == COUNTS
    for name, octrees in paper["octrees"].items():
        assert [octree["delta_percent"] for octree in octrees] == [2, 10, 50]
        for octree in octrees:
            loss = 100 * (1 - octree["leaves"] / COUNTS[name])
            assert octree["loss_percent"] == pytest.approx(loss, abs=0.005 if loss < 10 else 0.05)


def test_the_figures_say_what_the_text_says_of_them() -> None:
    """The geometry shader is the fastest for surfels; for voxels uniform, then texture buffers are."""
    paper = scans.PAPER
    for name in COUNTS:
        surfels, voxels = paper["surfels_ms"][name], paper["voxels_ms"][name]
        assert sorted(surfels, key=surfels.__getitem__) == ["gs", "ubo", "tbo", "vbo"]
        feeds = {feed: ms for feed, ms in voxels.items() if feed != "depth"}
        assert sorted(feeds, key=feeds.__getitem__) == ["ubo", "tbo", "gs", "vbo"]


def test_each_scan_meets_every_feed_in_two_passes() -> None:
    groups = feeds.groups()
    assert [(group.count, group.scene) for group in groups[:-1]] == [
        (COUNTS[scan.name], scan.scene) for scan in scans.scans()[:-1]
    ]
    assert (groups[-1].scene, groups[-1].count) == ("demo", None)
    assert {"gs", "ubo", "tbo", "vbo"} <= set(scans.feeds_of("surfels"))
    for group in groups:
        assert not group.judged
        floor, *others = group.contenders
        assert floor.backend == "gl-points"
        assert {contender.backend for contender in others} == {"surfels"}
        drawn = [each.params.instancing for each in others if each.params.passes == "two"]
        printed = [each.params.instancing for each in others if each.params.passes == "as_printed"]
        assert len(drawn) + len(printed) == len(others)
        assert set(printed) >= {"gs", "ubo", "tbo", "vbo"}
        assert drawn == scans.feeds_of("surfels")
        for contender in others:
            params = asdict(contender.params)
            expected = asdict(backend("surfels").params()) | {
                "instancing": params["instancing"], "passes": params["passes"], "enlarge": 2.0,
                "cull_back": True, "radius": "uniform", "surface": "nearest",
            }  # fmt: skip
            assert params == expected


@pytest.mark.slow
def test_the_scans_have_exactly_as_many_points_as_the_papers(data_dir: Path) -> None:
    for group in feeds.groups()[:-1]:
        subject = BenchSettings(data=data_dir).subject(group)
        for index in (0, subject.moments - 1):
            assert len(subject.moment(index).pose.cloud) == group.count
        again = catalog.subject(group.scene, data_dir, count=group.count)
        assert again.hash == subject.hash
