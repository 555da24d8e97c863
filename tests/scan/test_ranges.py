"""Ranges of colours over frames: of known numbers, of frames that lack them or cannot be read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.look import Look, is_open_range, with_range
from viewer.rigid import Rigid
from viewer.scan import formats
from viewer.scan.layers import Layers
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.ranges import ValueRanges, point_values, robust_range

LOOK = Look(color_by="shift")
POSITIONS = np.random.default_rng(0).uniform(0, 1, (1001, 3))


def cloud(reach: float, name: str = "shift") -> PointCloud:
    """Points whose scalar goes evenly from 0 to reach, and one outlier a thousand times as far."""
    values = np.append(np.linspace(0, reach, 1000), 1000 * reach).astype(np.float32)
    return PointCloud.from_arrays(POSITIONS, scalars={name: values})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for index, reach in enumerate((1.0, 8.0, 2.0, 4.0)):
        formats.write(tmp_path / f"{index}.npz", cloud(reach))
    return tmp_path


def test_a_range_spans_those_of_all_frames(folder: Path) -> None:
    with open_scan(folder) as timeline:
        ranges = ValueRanges(4)
        assert ranges.range(LOOK) is None
        ranges.take(timeline.pose(0), LOOK)
        assert ranges.range(LOOK) == robust_range(timeline.pose(0).cloud.scalars["shift"])
        ranges.gather(timeline, LOOK, range(4))
        assert ranges.known(LOOK) == 4
        low, high = ranges.range(LOOK) or (0, 0)
        assert low == pytest.approx(0.02, abs=0.001), "of the first frame"
        assert high == pytest.approx(0.98 * 8, rel=0.002), "of the second, without its outlier"
        assert ranges.known(Look(color_by="height")) == 0, "each source on its own"


def test_visiting_leaves_memory_as_it_is(folder: Path) -> None:
    with open_scan(folder) as timeline:
        timeline.pose(2)
        ValueRanges(4).gather(timeline, LOOK, range(4))
        assert timeline.cached() == [range(2, 3)]


def test_frames_without_the_number_and_broken_ones_are_known_and_tell_nothing(folder: Path) -> None:
    formats.write(folder / "1.npz", cloud(100.0, "other"))
    (folder / "2.npz").write_bytes(b"broken")
    with open_scan(folder) as timeline:
        ranges = ValueRanges(4)
        ranges.gather(timeline, LOOK, range(4))
        assert ranges.known(LOOK) == 4
        assert (ranges.range(LOOK) or (0, 0))[1] == pytest.approx(0.98 * 4, rel=0.002)
        assert list(timeline.broken) == [2]
        assert [notice.index for notice in timeline.messages if notice.kind == "broken"] == [2]


def test_heights_are_where_layers_move_points_to(folder: Path) -> None:
    pose, look = Pose(0, 0.0, "", cloud(1.0)), Look(color_by="height", up="+z")
    matrix = np.eye(4)
    matrix[2, 3] = 5e6
    lower, higher = (
        point_values(pose, look, Layers(world_from_pose=place)) for place in (Rigid(np.eye(4)), Rigid(matrix))
    )
    assert lower is not None
    assert higher is not None
    np.testing.assert_allclose(lower, POSITIONS[:, 2], atol=1e-6)
    np.testing.assert_allclose(higher - lower, 5e6, rtol=1e-12)


def test_numbers_laid_over_points_come_before_their_own() -> None:
    laid = np.full(1001, 7.0)
    values = point_values(Pose(0, 0.0, "", cloud(1.0)), LOOK, Layers({"shift": laid}))
    assert values is not None
    assert (values == 7).all()


@pytest.mark.parametrize("color_by", ["auto", "own", "depth", "absent"])
def test_what_no_points_have_has_no_range(color_by: str) -> None:
    assert point_values(Pose(0, 0.0, "", cloud(1.0)), Look(color_by=color_by)) is None


def test_constant_numbers_have_a_range_where_one_frame_differs(tmp_path: Path) -> None:
    same = PointCloud.from_arrays(POSITIONS, scalars={"shift": np.zeros(1001, np.float32)})
    formats.write(tmp_path / "0.npz", same)
    formats.write(tmp_path / "1.npz", cloud(1.0))
    with open_scan(tmp_path) as timeline:
        ranges = ValueRanges(2)
        ranges.gather(timeline, LOOK, [0])
        assert ranges.range(LOOK) == (0, 0)
        ranges.gather(timeline, LOOK, [1])
        assert ranges.range(LOOK) == (0, pytest.approx(0.98, rel=0.002))


def test_ends_that_are_given_stay() -> None:
    given = Look(color_by="shift", low=3.0)
    assert with_range(given, (0.0, 9.0)) == Look(color_by="shift", low=3.0, high=9.0)
    assert with_range(given, None) == Look(color_by="shift", low=3.0, range="frame")
    assert not is_open_range(Look(color_by="shift", low=3.0, high=4.0))
    assert not is_open_range(Look(color_by="shift", range="frame"))
    assert not is_open_range(Look())
    assert not is_open_range(Look(color_by="depth"))
