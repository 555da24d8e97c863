"""What the arrays of NPY and NPZ are: clouds, sequences, organised clouds, point maps; and their times."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.errors import InputError
from viewer.scan.open import open_scan
from viewer.scan.reading.arrays import is_organised, seconds_of_stamps

RNG = np.random.default_rng(0)


def picture(rows: int = 24, columns: int = 32, noise: float = 0.0) -> NDArray[np.float64]:
    """A curved surface as a depth camera sees it, (H, W, 3)."""
    y, x = np.mgrid[:rows, :columns] / columns
    points = np.stack([x, y, 1 + 0.3 * np.sin(4 * x) * y], axis=2)
    return points + RNG.normal(0, noise, points.shape)


def sphere(count: int) -> NDArray[np.float64]:
    """Points in the order of a spiral, neighbours near to each other."""
    z = np.linspace(-1, 1, count)
    angle = np.sqrt(count * np.pi) * np.arcsin(z)
    return np.stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z], axis=1)


def curve(count: int) -> NDArray[np.float64]:
    """Points along a line, such as the middle of a spine."""
    t = np.linspace(0, 1, count)
    return np.stack([t, 0.1 * np.sin(3 * t), 0 * t], axis=1)


@pytest.mark.parametrize("size", [(24, 32), (8, 16), (480, 640), (100, 300), (640, 48)])
@pytest.mark.parametrize("noise", [0, 0.0005])
def test_pictures_are_organised(size: tuple[int, int], noise: float) -> None:
    assert is_organised(picture(*size, noise))
    with_holes = picture(*size)
    with_holes[RNG.random(size) < 0.2] = np.nan
    with_holes[: size[0] // 4] = 0
    assert is_organised(with_holes)


@pytest.mark.parametrize("frames", [8, 30, 200])
@pytest.mark.parametrize("count", [16, 100, 3000])
def test_sequences_are_not_organised(frames: int, count: int) -> None:
    swaying = 0.05 * np.sin(np.arange(frames) / 10)[:, None, None]
    for points in (RNG.normal(size=(count, 3)), sphere(count), curve(count)):
        assert not is_organised(points + swaying)
    growing = np.linspace(1, 1.2, frames)[:, None, None]
    assert not is_organised(sphere(count) * growing)
    walking = np.arange(frames)[:, None, None] * [0.05, 0, 0]
    assert not is_organised(RNG.normal(size=(count, 3)) + walking)


@pytest.fixture(params=[".npy", ".npz"])
def suffix(request: pytest.FixtureRequest) -> str:
    kind: str = request.param
    return kind


def save(folder: Path, suffix: str, points: NDArray, name: str = "positions", **others: Any) -> Path:
    path = folder / f"scan{suffix}"
    if suffix == ".npy":
        np.save(path, points)
    else:
        np.savez(path, **{name: points}, **others)
    return path


def counts(path: Path, **how: Any) -> list[int]:
    with open_scan(path, **how) as scan:
        return [len(pose.cloud) for pose in scan]


@pytest.mark.parametrize("dtype", ["f2", "f4", "f8", ">f4"])
def test_an_organised_cloud_is_one_frame(tmp_path: Path, suffix: str, dtype: str) -> None:
    path = save(tmp_path, suffix, picture().astype(dtype))
    with open_scan(path) as scan:
        cloud = scan.pose(0).cloud
        decision = scan.reading["frames"]
    assert (len(cloud), decision.value, decision.source) == (768, "image", "assumed")
    assert decision.is_marked
    assert decision.alternatives == ("rows",)
    np.testing.assert_allclose(cloud.world(), picture().reshape(-1, 3), atol=1e-3)
    assert counts(path, read={"frames": "rows"}) == [32] * 24


def test_a_sequence_stays_one(tmp_path: Path, suffix: str) -> None:
    path = save(tmp_path, suffix, sphere(50) + np.arange(12)[:, None, None] * 0.01)
    with open_scan(path) as scan:
        assert len(scan) == 12
        assert not scan.reading["frames"].is_marked
    assert counts(path, read={"frames": "image"}) == [600]


def test_frames_of_organised_clouds(tmp_path: Path, suffix: str) -> None:
    maps = np.stack([picture(), picture() + 1]).astype(np.float32)
    path = save(tmp_path, suffix, maps, **({} if suffix == ".npy" else {"colors": maps}))
    assert counts(path) == [768, 768]
    if suffix == ".npz":
        with open_scan(path) as scan:
            assert scan.pose(1).cloud.colors is not None


@pytest.mark.parametrize("name", ["world_points", "pts3d", "point_map", "points3d", "Points", "arr_0"])
def test_names_of_other_programs(tmp_path: Path, name: str) -> None:
    maps = np.stack([picture(4, 6), picture(4, 6) + 1])
    rgb = np.full((2, 4, 6, 3), 0.5, np.float32)
    path = save(tmp_path, ".npz", maps, name, **{f"{name}_conf": maps[..., 0], "images": rgb})
    with open_scan(path) as scan:
        cloud = scan.pose(1).cloud
        assert len(scan) == 2
    assert (len(cloud), cloud.scalars[f"{name}_conf"].shape) == (24, (24,))
    assert cloud.colors is not None
    assert cloud.colors[0].tolist() == [128, 128, 128, 255]


def test_the_name_of_a_point_map_says_that_it_is_a_picture(tmp_path: Path) -> None:
    """However few its pixels are."""
    assert counts(save(tmp_path, ".npz", picture(3, 5), "pts3d")) == [15]
    assert counts(save(tmp_path, ".npz", picture(3, 5), "points", points_conf=np.ones((3, 5)))) == [15]
    assert counts(save(tmp_path, ".npz", picture(3, 5), "points")) == [5, 5, 5]


def test_rows_of_more_columns(tmp_path: Path, suffix: str) -> None:
    rows = np.array([(0, 0, 0, 200, 100, 50), (1, 0, 0, 10, 20, 30), (0, 1, 0, 0, 0, 255)], np.float32)
    with open_scan(save(tmp_path, suffix, rows)) as scan:
        cloud = scan.pose(0).cloud
        assert "columns" in scan.reading.assumed
    assert cloud.colors is not None
    assert cloud.colors[:, :3].tolist() == rows[:, 3:].tolist()
    with open_scan(save(tmp_path, suffix, rows), read={"columns": "r g b x y z"}) as scan:
        np.testing.assert_array_equal(scan.pose(0).cloud.world(), rows[:, 3:])


def test_arrays_of_fields(tmp_path: Path, suffix: str) -> None:
    fields = [
        ("x", "f4"),
        ("y", "f4"),
        ("z", "f4"),
        ("red", "u1"),
        ("green", "u1"),
        ("blue", "u1"),
        ("h", "f8"),
    ]
    points = np.array([(1, 2, 3, 255, 0, 0, 9), (4, 5, 6, 0, 255, 0, 8)], fields)
    with open_scan(save(tmp_path, suffix, points, "points")) as scan:
        cloud = scan.pose(0).cloud
    np.testing.assert_array_equal(cloud.world(), [(1, 2, 3), (4, 5, 6)])
    np.testing.assert_array_equal(cloud.scalars["h"], (9, 8))
    assert cloud.colors is not None
    assert cloud.colors[:, :3].tolist() == [[255, 0, 0], [0, 255, 0]]


@pytest.mark.parametrize(
    ("name", "value", "times"),
    [
        ("fps", 50.0, [0, 0.02, 0.04]),
        ("rate", np.array([50]), [0, 0.02, 0.04]),
        ("mocap_framerate", np.float32(50), [0, 0.02, 0.04]),
        ("mocap_frame_rate", 50, [0, 0.02, 0.04]),
        ("frequency", 50, [0, 0.02, 0.04]),
        ("sampling_rate", 50, [0, 0.02, 0.04]),
        ("Hz", "50", [0, 0.02, 0.04]),
        ("fps", np.full(3, 50.0), [0, 0.02, 0.04]),
        ("dt", 0.02, [0, 0.02, 0.04]),
        ("t", np.array([[1.0], [1.5], [3.0]]), [0, 0.5, 2]),
        ("times_ms", np.array([10, 30, 70]), [0, 0.02, 0.06]),
        ("timestamps_us", np.array([10, 20010, 60010]), [0, 0.02, 0.06]),
        (
            "timestamps",
            np.array(["2024-05-01T12:00:00.000", "2024-05-01T12:00:00.020", "2024-05-01T12:00:01"]).astype(
                "M8[ms]"
            ),
            [0, 0.02, 1],
        ),
        ("timestamps", np.array([3.0, 2.0, 1.0]), [0, 0.04, 0.08]),
        ("times", np.array([1.0, 1.5, 3.0]), [1, 1.5, 3]),
        ("timestamps", np.array([1.0, 1.5, 3.0]), [0, 0.5, 2]),
        ("timestamps", np.array([0, 20, 60]) + 1_700_000_000_000, [0, 0.02, 0.06]),
        ("timestamps", np.array([0, 20_000, 60_000]) + 1_700_000_000_000_000, [0, 0.02, 0.06]),
        ("timestamps", np.array([0, 20_000_000, 60_000_000]) + 1_700_000_000_000_000_000, [0, 0.02, 0.06]),
        ("fps", np.array([1.0, 2.0]), [0, 0.04, 0.08]),
        ("fps", 0.0, [0, 0.04, 0.08]),
    ],
)
def test_times_and_rates(tmp_path: Path, name: str, value: Any, times: list[float]) -> None:
    path = save(tmp_path, ".npz", RNG.normal(size=(3, 5, 3)), **{name: value})
    with open_scan(path) as scan:
        np.testing.assert_allclose(scan.times, times, atol=1e-9)


def test_time_stamps_stay_exact() -> None:
    stamps = np.array([0, 1], np.uint64) + np.uint64(1_700_000_000_000_000_000)
    np.testing.assert_allclose(seconds_of_stamps(stamps), [0, 1e-9], rtol=1e-12)


def test_an_archive_without_points_lists_its_arrays(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        open_scan(save(tmp_path, ".npz", np.ones((4, 3)), "corners"))
    assert "only: corners (4, 3)" in str(caught.value)
    assert "(H, W, 3)" in str(caught.value)


@pytest.mark.parametrize("suffix", [".npy", ".npz"])
@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("dtype", ["<f8", ">f4"])
def test_coordinates_in_front_of_the_points(tmp_path: Path, suffix: str, order: str, dtype: str) -> None:
    path = tmp_path / f"scan{suffix}"

    def opened(values: NDArray) -> tuple[int, NDArray, str]:
        stored = np.array(values, dtype, order=order)
        np.save(path, stored) if suffix == ".npy" else np.savez(path, pts3d=stored)
        with open_scan(path) as scan:
            return len(scan), scan.pose(len(scan) - 1).cloud.world(), scan.reading["columns"].source

    points = picture().astype(np.float32)
    many = points.reshape(-1, 3)
    frames, found, source = opened(many.T)
    assert (frames, source) == (1, "assumed")
    np.testing.assert_allclose(found, many)
    frames, found, _ = opened(points.transpose(2, 0, 1))
    assert frames == 1
    np.testing.assert_allclose(found, many)
    frames, found, _ = opened(np.stack([points, points + 1]).transpose(0, 3, 1, 2))
    assert frames == 2
    np.testing.assert_allclose(found, many + 1)
    assert opened(many[:3])[0] == 1, "three points stay rows"


def test_columns_of_several_frames(tmp_path: Path) -> None:
    """Each frame has rows of x, y, z and colours."""
    table = np.concatenate([RNG.normal(size=(3, 50, 3)), RNG.integers(0, 256, (3, 50, 3))], axis=2)
    for name in (".npy", ".npz"):
        with open_scan(save(tmp_path, name, table)) as scan:
            assert len(scan) == 3
            cloud = scan.pose(2).cloud
        np.testing.assert_allclose(cloud.world(), table[2, :, :3], atol=1e-6)
        np.testing.assert_array_equal(cloud.colors[:, :3], table[2, :, 3:])


@pytest.mark.parametrize("shape", [(50,), (2, 50)])
def test_fields_of_several_numbers(tmp_path: Path, shape: tuple[int, ...]) -> None:
    fields = np.zeros(shape, [("xyz", "f4", 3), ("rgb", "u1", 3), ("normal", "f4", 3), ("quality", "f4")])
    fields["xyz"], fields["rgb"], fields["normal"] = RNG.normal(size=(*shape, 3)), (200, 100, 50), (0, 0, 1)
    for name in (".npy", ".npz"):
        with open_scan(save(tmp_path, name, fields)) as scan:
            assert len(scan) == len(shape)
            cloud = scan.pose(len(scan) - 1).cloud
        np.testing.assert_allclose(cloud.world(), fields["xyz"].reshape(-1, 50, 3)[-1], atol=1e-6)
        assert cloud.colors[0].tolist() == [200, 100, 50, 255]
        assert cloud.normals[0].tolist() == [0, 0, 1]
        assert [*cloud.scalars] == ["quality"]


@pytest.mark.parametrize("shape", [(40,), (5, 8)])
def test_arrays_of_one_coordinate_each(tmp_path: Path, shape: tuple[int, ...]) -> None:
    x, y, z = RNG.normal(size=(3, *shape))
    path = tmp_path / "scan.npz"
    np.savez(
        path, X=x, Y=y, Z=z, red=np.full(shape, 200, np.uint8), **dict.fromkeys(("green", "blue"), x * 0)
    )
    with open_scan(path) as scan:
        cloud = scan.pose(0).cloud
    np.testing.assert_allclose(cloud.world(), np.stack([x.ravel(), y.ravel(), z.ravel()], 1), atol=1e-6)
    assert cloud.colors[0].tolist() == [200, 0, 0, 255]


@pytest.mark.parametrize(
    ("points", "colors", "normals"),
    [
        ("verts", "vertex_colors", "normal"),
        ("positions", "rgb", "vertex_normals"),
        ("pc", "color", "normals"),
    ],
)
def test_other_names_of_attributes(tmp_path: Path, points: str, colors: str, normals: str) -> None:
    xyz = RNG.normal(size=(40, 3))
    arrays = {points: xyz, colors: np.full((40, 3), 0.5), normals: np.tile([0, 0, 1.0], (40, 1))}
    path = tmp_path / "scan.npz"
    np.savez(path, **arrays, betas=np.zeros(10))
    with open_scan(path) as scan:
        cloud = scan.pose(0).cloud
        assert scan.reading.unused == ("array betas (10,)",)
    assert cloud.colors[0].tolist() == [128, 128, 128, 255]
    assert cloud.normals[0].tolist() == [0, 0, 1]
