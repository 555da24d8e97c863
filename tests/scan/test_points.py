from __future__ import annotations

import pickle
import warnings

import numpy as np
import pytest

import viewer
from viewer.errors import InputError
from viewer.scan.points import PointCloud


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e18, -1e37])
def test_points_that_float32_cannot_work_with_are_dropped_and_counted(value: float) -> None:
    points = np.random.default_rng(0).normal(size=(1000, 3))
    points[7, 1] = points[500, 2] = value
    cloud = PointCloud.from_arrays(points, colors=np.arange(3000).reshape(1000, 3) % 255 / 255)
    assert (len(cloud), cloud.dropped) == (998, 2)
    assert cloud.ids is not None
    assert 7 not in cloud.ids
    assert cloud.ids[-1] == 999
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert (viewer.render(cloud, size=(40, 30)).coverage > 0).any()


def test_the_largest_coordinates_still_draw() -> None:
    cloud = PointCloud.from_arrays(np.random.default_rng(0).normal(size=(1000, 3)) * 1e16)
    assert (viewer.render(cloud, size=(40, 30)).coverage > 0).any()


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"positions": np.zeros((3, 2))}, r"expected \(N, 3\)"),
        ({"positions": np.zeros((3, 3), complex)}, "expected numbers"),
        ({"positions": np.zeros((3, 3)), "normals": np.zeros((2, 3))}, "normals have shape"),
        ({"positions": np.zeros((3, 3)), "colors": np.zeros((3, 2))}, "colors have shape"),
        ({"positions": np.zeros((3, 3)), "scalars": {"q": np.zeros(4)}}, "values of 'q'"),
    ],
)
def test_arrays_that_do_not_fit_are_explained(arrays: dict[str, np.ndarray], message: str) -> None:
    with pytest.raises(InputError, match=message):
        PointCloud.from_arrays(**arrays)


def test_an_argument_of_another_name_is_refused() -> None:
    with pytest.raises(TypeError, match=r"no argument intensity, time\. Attributes are normals, .*scalars="):
        PointCloud.from_arrays(np.eye(3), time=np.arange(3), intensity=np.arange(3))  # type: ignore[call-arg]


def test_one_far_outlier_moves_neither_origin_nor_bounds() -> None:
    body = np.random.default_rng(0).uniform(-1, 1, (5000, 3)) + 1000
    alone = PointCloud.from_arrays(body)
    joined = PointCloud.from_arrays(np.concatenate([body, [[1e9, 0, 0]]]))
    np.testing.assert_array_equal(alone.origin, joined.origin)
    np.testing.assert_allclose(alone.bounds().low, joined.bounds().low, rtol=1e-6)
    np.testing.assert_allclose(alone.bounds().high, joined.bounds().high, rtol=1e-6)


def test_poses_of_a_sequence_share_an_origin() -> None:
    body = np.random.default_rng(0).normal(size=(5000, 3)) + np.array([4e6, 5e6, 101])
    origins = {tuple(PointCloud.from_arrays(body + 0.001 * i).origin) for i in range(10)}
    assert len(origins) == 1


@pytest.mark.parametrize("length", [1e7, 1e15, 1e17])
def test_splats_far_larger_than_the_scan_are_shortened_and_counted(length: float) -> None:
    rng = np.random.default_rng(0)
    points, normals = rng.random((50, 3)), rng.normal(size=(50, 3))
    axes = np.column_stack([np.cross(normals, (0, 0, 1)), np.full(50, 0.5)])
    axes[3, :3] *= length / np.linalg.norm(axes[3, :3])
    axes[9, 3] = length
    cloud = PointCloud.from_arrays(points, normals=normals, axes=axes)
    assert cloud.shortened == 2
    extent = np.ptp(points, axis=0).max()
    assert 0.5e6 * extent < cloud.splat_reach().max() < 1e6
    kept = np.delete(np.arange(50), [3, 9])
    np.testing.assert_array_equal(cloud.axes[kept], axes[kept].astype(np.float32))
    depth = viewer.render(cloud, backend="surfels", size=(40, 30)).depth
    assert not np.isnan(depth).any()

    radii = np.full(50, 0.1, np.float32)
    radii[7] = length
    cloud = PointCloud.from_arrays(points, normals=normals, radii=radii)
    assert cloud.shortened == 1
    assert 0.5e6 * extent < cloud.radii[7] < 1e6
    assert radii[7] == np.float32(length), "what was given stays"


def test_a_splat_of_a_single_point_keeps_its_size() -> None:
    cloud = PointCloud.from_arrays(np.ones((1, 3)), radii=np.array([5.0]))
    assert (cloud.radii[0], cloud.shortened) == (5, 0)


def test_facts_are_found_once_and_stay_where_they_were_found() -> None:
    cloud, found = PointCloud.from_arrays([[0.0, 0, 0], [1, 2, 3]]), []

    def count(points: PointCloud, times: int) -> int:
        found.append(times)
        return times * len(points)

    assert [cloud.remember(count, times) for times in (2, 3, 2, 3)] == [4, 6, 4, 6]
    assert found == [2, 3]
    copy = pickle.loads(pickle.dumps(cloud))  # as it goes to another process, though `count` could not
    assert np.array_equal(copy.positions, cloud.positions)
    assert copy.remember(count, 2) == 4
    assert found == [2, 3, 2]


def test_coordinates_keep_their_float64_precision() -> None:
    points = np.random.default_rng(3).uniform(-5e3, 5e3, (400_000, 3)) + np.array([5e5, 5.4e6, 300])
    cloud = PointCloud.from_arrays(points)
    assert np.abs(cloud.world() - points).max() <= np.spacing(5.4e6)
    assert np.abs(cloud.positions + cloud.origin - points).max() > 1e-4, "which offsets alone have not"
    np.testing.assert_array_equal(cloud.world(7), cloud.world()[7])
    assert cloud.nbytes == 24 * len(points)
    near = cloud.centered(points[9])
    close = np.linalg.norm(points - points[9], axis=1) < 500
    assert close.sum() > 10
    assert np.abs(near.positions + points[9] - points)[close].max() < 2e-5
    assert near.remainders is None


def test_each_point_moved_by_its_own() -> None:
    cloud = PointCloud.from_arrays(np.array([[1e7, 0, 0], [1e7 + 1 / 3, 1, 0], [3e7, 0, 1]]))
    assert cloud.remainders is not None
    by = np.array([[0.1, 0, 0], [-1 / 3, 0, 0], [0, 0, 5]])
    moved = cloud.displaced(by)
    assert moved.remainders is None
    np.testing.assert_allclose(moved.world(), cloud.world() + by, rtol=0, atol=6e-8 * 2e7)


def test_what_float32_offsets_hold_has_no_remainders() -> None:
    points = np.random.default_rng(3).random((1000, 3), np.float32) + np.float32(100)
    assert PointCloud.from_arrays(points).remainders is None
    assert PointCloud.from_arrays(points.astype(np.float64)).remainders is None
    assert PointCloud.from_arrays(points.astype(np.float64) + 0.1, precise=False).remainders is None


def test_a_cloud_is_moved_with_its_viewpoint() -> None:
    cloud = PointCloud.from_arrays(np.eye(3), viewpoint=(1, 2, 3))
    moved = cloud.moved(np.array([0.5, 0, -4]))
    assert moved.viewpoint.tolist() == [1.5, 2, -1]
    assert moved.world() == pytest.approx(cloud.world() + np.array([0.5, 0, -4]))
    assert PointCloud.from_arrays(np.eye(3)).moved(np.ones(3)).viewpoint is None


def test_arrays_of_another_cloud_are_taken_where_they_hold_the_same() -> None:
    rng = np.random.default_rng(5)
    positions, colors = rng.random((300_000, 3), np.float32), rng.integers(0, 256, (300_000, 4), np.uint8)
    radii = rng.random(300_000).astype(np.float32)
    radii[7] = np.nan
    kinds = {"kind": np.arange(300_000), "heat": radii}

    def read(moved: float) -> PointCloud:
        values = {name: each.copy() for name, each in kinds.items()}
        values["heat"][-1] = moved
        return PointCloud.from_arrays(
            positions + np.float32(moved),
            colors=colors.copy(),
            radii=radii.copy(),
            scalars=values,
            origin=np.zeros(3),
        )

    first, second = read(0.0), read(1.0)
    shared = second.sharing(first)
    assert shared.colors is first.colors
    assert shared.radii is first.radii, "NaN and all"
    assert shared.scalars["kind"] is first.scalars["kind"]
    assert shared.scalars["heat"] is second.scalars["heat"], "the last one is another"
    assert shared.positions is second.positions
    fewer = PointCloud.from_arrays(positions[1:], colors=colors[1:])
    assert fewer.sharing(first) is fewer
    zeros = PointCloud.from_arrays(np.zeros((9, 3), np.float32), radii=np.zeros(9), origin=np.zeros(3))
    below = PointCloud.from_arrays(np.zeros((9, 3), np.float32) - 1, radii=-np.zeros(9), origin=np.zeros(3))
    assert below.sharing(zeros) is below, "equal numbers of other bits"


def test_colours_of_four_bytes_are_taken_as_they_are() -> None:
    colors = np.full((2, 4), 9, np.uint8)
    assert PointCloud.from_arrays(np.zeros((2, 3)), colors=colors).colors is colors


def test_rows_that_were_not_measured_are_dropped_and_counted_apart_from_those_that_are_not_finite() -> None:
    points = np.arange(30.0).reshape(10, 3)
    points[2], points[5:8], points[7, 0] = np.nan, 0, np.inf
    cloud = PointCloud.from_arrays(
        points, colors=np.arange(30).reshape(10, 3), unmeasured=("0 0 0", (points == 0).all(axis=1))
    )
    assert cloud.dropped == 4
    assert cloud.dropped_by == {"not finite": 2, "0 0 0": 2}
    np.testing.assert_array_equal(cloud.ids, [0, 1, 3, 4, 8, 9])
    np.testing.assert_array_equal(cloud.colors[:, 0], 3 * cloud.ids)
