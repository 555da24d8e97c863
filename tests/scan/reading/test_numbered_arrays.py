"""NPZ files in which each frame has arrays of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.scan.open import open_scan

RNG = np.random.default_rng(8)
CLOUD = RNG.normal(size=(200, 3)) * 10
UNIT = CLOUD / np.linalg.norm(CLOUD, axis=1, keepdims=True)
COLORS = RNG.integers(0, 256, (200, 3), np.uint8)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "scan.npz"


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
@pytest.mark.parametrize(
    "name", ["frame_{:03}", "points_{}", "frame{}", "t-{}", "{}", "Cloud {}", "verts.{}"]
)
def test_numbered_arrays_are_frames_in_natural_order(save, name: str, path: Path) -> None:
    save(path, **{name.format(number): CLOUD[: 50 + number] + number for number in (10, 2, 0, 1)})
    with open_scan(path) as scan:
        found = [scan.pose(frame).cloud.world() for frame in range(len(scan))]
        for number, world in zip((0, 1, 2, 10), found, strict=True):
            np.testing.assert_allclose(world, CLOUD[: 50 + number] + number, atol=1e-5)
        assert scan.reading["frames"].value == f"arrays {name.format(0)} to {name.format(10)}"


def test_arrays_without_names_are_frames_by_assumption(path: Path) -> None:
    np.savez(path, CLOUD, CLOUD[:150], CLOUD[:100])
    with open_scan(path) as scan:
        assert [len(scan.pose(frame).cloud) for frame in range(len(scan))] == [200, 150, 100]
        decision = scan.reading["frames"]
        assert (decision.value, decision.source) == ("arrays arr_0 to arr_2", "assumed")
        assert decision.changes_numbers
    with open_scan(path, read={"frames": "cloud"}) as scan:
        assert (len(scan), len(scan.pose(0).cloud)) == (1, 200)
        assert scan.reading["frames"].source == "user"
        assert not scan.messages


@pytest.mark.parametrize(
    "others", [[UNIT], [COLORS], [COLORS / 255.0], [UNIT, COLORS / 255.0], [np.arange(200)], [np.eye(3)]]
)
def test_attributes_without_names_are_no_frames(others: list[np.ndarray], path: Path) -> None:
    np.savez(path, CLOUD, *others)
    with open_scan(path) as scan:
        assert (len(scan), len(scan.pose(0).cloud)) == (1, 200)


def test_attributes_of_each_frame_and_of_all(path: Path) -> None:
    np.savez(
        path,
        points_0=CLOUD,
        points_1=CLOUD[:150],
        colors_0=COLORS,
        colors_1=COLORS[:150] // 2,
        normals_1=UNIT[:150],
        K_0=np.eye(3),
        K_1=np.eye(3),
        fps=10,
    )
    with open_scan(path) as scan:
        np.testing.assert_allclose(scan.times, [0, 0.1])
        first, second = (scan.pose(frame).cloud for frame in range(2))
        assert first.normals is None
        np.testing.assert_allclose(second.normals, UNIT[:150], atol=1e-6)
        np.testing.assert_array_equal(first.colors[:, :3], COLORS)
        np.testing.assert_array_equal(second.colors[:, :3], COLORS[:150] // 2)


def test_fields_and_more_columns(path: Path) -> None:
    fields = np.zeros(50, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("label", "i2")])
    fields["x"], fields["y"], fields["z"] = CLOUD[:50].T
    np.savez(path, frame_1=fields, frame_2=fields[:40])
    with open_scan(path) as scan:
        assert [len(scan.pose(frame).cloud) for frame in range(2)] == [50, 40]
        assert list(scan.pose(1).cloud.scalars) == ["label"]
    np.savez(path, frame_1=np.column_stack([CLOUD, COLORS]), frame_2=np.column_stack([CLOUD, COLORS]))
    with open_scan(path) as scan:
        assert len(scan) == 2
        np.testing.assert_array_equal(scan.pose(1).cloud.colors[:, :3], COLORS)


def test_numbered_range_images_are_frames(path: Path) -> None:
    depth = np.add.outer(np.arange(24) * 0.01, np.arange(32) * 0.005) + 1
    images = {f"depth_{number}": depth + number for number in range(12)}
    np.savez(path, fx=30.0, fy=30.0, cx=15.5, cy=11.5, **images)
    with open_scan(path) as scan:
        assert len(scan) == 12
        (view,) = scan.pose(10).views
        np.testing.assert_allclose(view.depth, depth + 10, rtol=1e-6)
        assert (view.fx, view.cx) == (30, 16)
        assert scan.reading["frames"].source == "file"


def test_numbered_values_of_points_are_no_frames(path: Path) -> None:
    np.savez(path, positions=CLOUD, mode_0=UNIT, mode_1=UNIT, weight_0=CLOUD[:, 0], weight_1=CLOUD[:, 1])
    with open_scan(path) as scan:
        assert len(scan) == 1
        assert set(scan.pose(0).cloud.scalars) == {"weight_0", "weight_1"}
