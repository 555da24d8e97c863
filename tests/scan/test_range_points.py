"""Points of range views: merged when they are asked for, and what is known of them before."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from threading import Barrier

import numpy as np
import pytest
from range_scenes import LENSES, shape_view, sphere_view

from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud, strided
from viewer.scan.pose import Pose
from viewer.scan.range_points import RangePoints
from viewer.scan.range_view import RangeView, merge
from viewer.scan.spacing import ENOUGH, nearest_row, spacing_at, typical_spacing
from viewer.scan.timeline import Timeline

FAR = np.array([665187.25, 5648349.5, 241.75])
VIEWS = (sphere_view((0, 0, 4), size=(160, 140)), sphere_view((3, 0, 3), size=(90, 120), name="right"))
EYES = FAR + np.array([[0, 0, 4], [3, 0, 3]])
LARGE = (sphere_view(EYES[0], FAR, (400, 300)), sphere_view(EYES[1], FAR, (300, 400)))


def same(one: PointCloud, other: PointCloud) -> bool:
    """Whether two clouds are equal to the bit."""
    arrays = [(getattr(one, name), getattr(other, name)) for name in ("positions", "origin", "colors", "ids")]
    arrays += [(one.scalars[name], other.scalars[name]) for name in (*one.scalars, *other.scalars)]
    return all(np.array_equal(a, b) for a, b in arrays)


@pytest.mark.parametrize("views", [VIEWS, LARGE, LARGE[:1]])
def test_what_is_known_before_is_what_is_found_of_all(views: tuple) -> None:
    pose = Pose.of(0, 0.0, "x", views)
    sample, bounds, count = pose.sample, pose.bounds, pose.count
    assert not pose.is_merged
    cloud = merge(views)
    assert count == len(cloud)
    assert np.array_equal(pose.origin, cloud.origin)
    assert np.array_equal(sample, strided(cloud.positions))
    assert (pose.overview.scalars.keys(), pose.overview.colors.shape[1]) == (cloud.scalars.keys(), 4)
    assert np.array_equal(pose.overview.ids, strided(cloud.ids))
    every = cloud.bounds()
    assert (bounds.low >= every.low).all()
    assert (bounds.high <= every.high).all()
    assert bounds.radius == pytest.approx(every.radius, rel=0.02)
    assert not pose.is_merged
    assert same(pose.cloud, cloud)
    assert pose.is_merged


def test_points_are_merged_once_whoever_asks() -> None:
    pose = Pose.of(0, 0.0, "x", LARGE)
    again, before = replace(pose, index=7), pose.nbytes
    assert before == pose.overview.nbytes + sum(view.nbytes for view in LARGE)
    together = Barrier(6)

    def ask(one: Pose) -> PointCloud:
        together.wait()
        return one.cloud

    with ThreadPoolExecutor(6) as threads:
        clouds = list(threads.map(ask, [pose, again] * 3))
    assert {id(cloud) for cloud in clouds} == {id(pose.cloud)}
    assert pose.nbytes == again.nbytes == before + pose.cloud.nbytes


FORMS = [
    *((kind, lens, False) for kind in ("z", "range") for lens in LENSES),
    *((kind, "none", measured) for kind, measured in (("z", True), ("height", False), ("height", True))),
]


def scenes() -> dict[str, tuple[RangeView, ...]]:
    """Views of all kinds, and of one place from several sides."""
    around = [np.array([4 * np.sin(turn), 0.3, 4 * np.cos(turn)]) for turn in np.arange(5) * 1.2]
    forms = {" ".join(map(str, form)): (shape_view("sphere", *form)[0],) for form in FORMS}
    return {"two": VIEWS, "far": LARGE, "round": tuple(sphere_view(eye) for eye in around), **forms}


@pytest.mark.parametrize("name", scenes())
def test_what_is_found_of_samples_is_what_merged_points_have(name: str) -> None:
    points = RangePoints.of(scenes()[name])
    cloud, rng = merge(points.views), np.random.default_rng(0)
    rows = rng.choice(len(cloud), 25, replace=False)
    samples = cloud.ids[rows]
    assert np.array_equal(points.of_samples("positions", samples), cloud.positions[rows])
    if cloud.colors is not None:
        assert np.array_equal(points.of_samples("colors", samples), cloud.colors[rows])
    for scalar, values in cloud.scalars.items():
        assert np.array_equal(points.of_samples(scalar, samples), values[rows])
        assert np.array_equal(points.all_samples(scalar)[cloud.ids], values)
    assert [points.row_of(int(sample)) for sample in samples] == rows.tolist()
    numbers, places = (np.concatenate(part) for part in zip(*points.parts(), strict=True))
    assert np.array_equal(numbers, cloud.ids)
    assert np.array_equal(places, cloud.positions)
    assert not points.is_merged
    spread = points.by_sample(cloud.positions[:, 0])
    assert np.array_equal(spread[cloud.ids], cloud.positions[:, 0])
    assert np.isnan(spread).sum() == len(spread) - len(cloud)
    assert [points.row_of(int(sample)) for sample in samples] == rows.tolist()


@pytest.mark.parametrize("name", scenes())
def test_what_lies_around_a_place_is_found_without_merging(name: str) -> None:
    """The nearest points, and what spacings are found by, are those of all points."""
    points = RangePoints.of(scenes()[name])
    cloud, rng = merge(points.views), np.random.default_rng(1)
    for row in rng.choice(len(cloud), 12, replace=False).tolist():
        around = points.around(cloud.world()[row], ENOUGH)
        at = around.row_of(int(cloud.ids[row]))
        assert np.allclose(around.positions[at], cloud.positions[row], rtol=0, atol=1e-6)
        assert {name: v[at] for name, v in around.scalars.items()} == {
            n: v[row] for n, v in cloud.scalars.items()
        }
        assert spacing_at(around, at) == pytest.approx(spacing_at(cloud, row), rel=1e-5)
        beside = cloud.world()[row] + rng.normal(0, 0.1, 3)
        expected = np.sort(np.linalg.norm(cloud.world() - beside, axis=1))
        found = np.sort(np.linalg.norm(points.around(beside, 40).world() - beside, axis=1))
        assert found[:40] == pytest.approx(expected[:40], rel=1e-5)
        assert nearest_row(points.around(beside), beside)[1] == pytest.approx(expected[0], rel=1e-5)
    for far in (cloud.origin + 50, cloud.origin - (0, 0, 50), points.views[0].eye):
        found = np.linalg.norm(points.around(far).world() - far, axis=1)
        assert found.min() == pytest.approx(np.linalg.norm(cloud.world() - far, axis=1).min(), rel=1e-5)
    assert points.around(far, 10**9).ids.tolist() == cloud.ids.tolist(), "all that there are"
    assert points.spacing == pytest.approx(typical_spacing(cloud), rel=0.5)
    assert not points.is_merged


@pytest.mark.parametrize("merged", [False, True])
def test_they_go_to_another_process_as_they_are(merged: bool) -> None:
    pose = Pose.of(0, 0.0, "x", VIEWS)
    if merged:
        assert len(pose.cloud)
    there = pickle.loads(pickle.dumps(pose))
    assert there.is_merged == merged
    assert same(there.cloud, pose.cloud)


def test_estimates_stand_beside_the_views() -> None:
    pose = Pose.of(0, 0.0, "x", VIEWS)
    cloud = replace(pose.cloud, radii=np.ones(pose.count, np.float32))
    more = pose.with_cloud(cloud)
    assert (more.cloud, more.views) == (cloud, VIEWS)
    assert pose.cloud.radii is None
    assert Pose(0, 0.0, "x", pose.cloud).with_cloud(cloud).cloud is cloud


def test_moved_points_keep_their_bits() -> None:
    pose = Pose.of(0, 0.0, "x", LARGE)
    moved = pose.points.moved(VIEWS, -FAR)
    assert moved.views is VIEWS
    assert not pose.is_merged
    assert same(moved.cloud, replace(pose.cloud, origin=pose.origin - FAR))
    assert np.array_equal(moved.overview.origin, moved.cloud.origin)
    assert same(pickle.loads(pickle.dumps(pose.points.moved(VIEWS, -FAR))).cloud, moved.cloud)


def test_views_that_see_nothing_are_told_at_once() -> None:
    blind = replace(VIEWS[0], mask=np.zeros_like(VIEWS[0].mask))
    with pytest.raises(InputError, match="contains no points"):
        Pose.of(0, 0.0, "x", (blind, blind))
    assert Pose.of(0, 0.0, "x", (blind, VIEWS[1])).count == np.count_nonzero(VIEWS[1].valid())


def test_a_timeline_reads_without_merging_and_lets_go_where_others_merge(tmp_path: Path) -> None:
    for index in range(6):
        formats.write(tmp_path / f"f{index}.exr", merge(VIEWS), VIEWS)
    with open_scan(tmp_path) as timeline:
        poses = list(timeline)
    assert not any(pose.is_merged for pose in poses)
    assert not timeline.messages
    size = poses[0].nbytes
    with open_scan(tmp_path) as source:
        timeline = Timeline(source.source, source.times, cache_bytes=6 * size + 100)
    with timeline:
        poses = list(timeline)
        assert timeline.cached() == [range(6)]
        for pose in poses:
            assert len(pose.cloud)
        timeline.request(3)
        held = [index for run in timeline.cached() for index in run]
        assert {3, 5} <= {*held}, "the others were used longer ago"
        assert sum(poses[index].nbytes for index in held) <= 6 * size + 100
