"""The pose cache against its budget and its order."""

from __future__ import annotations

import numpy as np
import pytest
from range_scenes import sphere_view

from viewer.errors import InputError
from viewer.scan.cache import PoseCache, default_budget
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose


def pose(index: int, points: int = 10) -> Pose:
    """12 bytes a point."""
    return Pose(index, float(index), str(index), PointCloud.from_arrays(np.ones((points, 3), np.float32)))


def test_least_recently_used_goes_first() -> None:
    cache = PoseCache(3 * 120)
    for index in range(3):
        assert cache.put(pose(index))
    assert cache.get(0) is not None
    cache.put(pose(3))
    assert list(cache) == [2, 0, 3]
    assert cache.nbytes == 360


def test_never_exceeds_its_budget_for_poses_of_any_size() -> None:
    cache = PoseCache(5000)
    sizes = np.random.default_rng(1).integers(1, 500, 200)
    for index, size in enumerate(sizes):
        held = cache.put(pose(index, int(size)))
        assert held == (size * 12 <= 5000)
        assert cache.nbytes == sum(12 * int(sizes[at]) for at in cache) <= 5000


def test_a_pose_larger_than_the_budget_is_refused_and_evicts_nothing() -> None:
    cache = PoseCache(300)
    cache.put(pose(0))
    assert not cache.put(pose(1, points=100))
    assert list(cache) == [0]


def test_what_is_to_be_kept_is_not_evicted() -> None:
    cache = PoseCache(3 * 120)
    for index in range(3):
        cache.put(pose(index))
    assert cache.put(pose(3), is_needed={0, 1}.__contains__)
    assert set(cache) == {0, 1, 3}
    assert not cache.put(pose(4), is_needed={0, 1, 3}.__contains__)
    assert set(cache) == {0, 1, 3}


def test_the_same_pose_twice_counts_once() -> None:
    cache = PoseCache(1000)
    cache.put(pose(0))
    cache.put(pose(0, points=20))
    assert cache.nbytes == 240


def test_what_is_merged_later_is_counted() -> None:
    views = (sphere_view((0, 0, 4)),)
    poses = [Pose.of(index, 0.0, "", views) for index in range(4)]
    before = poses[0].nbytes
    cache = PoseCache(4 * before)
    assert all(cache.put(pose) for pose in poses[:3])
    assert cache.nbytes == 3 * before
    grown = poses[0].cloud.nbytes
    assert cache.nbytes == 3 * before + grown == before + cache.size_of(0) + cache.size_of(1)
    assert cache.put(poses[3])
    assert list(cache) == [1, 2, 3], "all four are more than it holds"
    for pose in poses[1:]:
        assert pose.cloud.nbytes == grown
    cache.trim()
    assert cache.nbytes == sum(cache.size_of(index) for index in cache) <= cache.budget
    assert list(cache)[-1] == 3, "the least recently used went first"
    cache.clear()
    assert cache.nbytes == 0


def test_touch_sets_the_order() -> None:
    cache = PoseCache(1000)
    for index in range(3):
        cache.put(pose(index))
    cache.touch([2, 0])
    assert list(cache) == [1, 2, 0]


def test_budget_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SCAN4D_CACHE_MB", raising=False)
    assert default_budget() == 1 << 30
    monkeypatch.setenv("SCAN4D_CACHE_MB", "64")
    assert default_budget() == 64 << 20
    monkeypatch.setenv("SCAN4D_CACHE_MB", "lots")
    with pytest.raises(InputError, match="SCAN4D_CACHE_MB: 'lots' is not a number of megabytes"):
        default_budget()
