"""NPZ of depth, of organised grids and of terrains: range views of each, and arrays that do not fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from range_scenes import LENSES, camera_points, shape_view

from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.admission import READ_VARIABLE
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.range_view import RangeView

IMAGE_AXES = np.diag([1.0, -1, -1, 1])


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "scan.npz"


def save(path: Path, **arrays: object) -> RangeView:
    np.savez(path, **arrays)
    (view,) = formats.read(path)
    return view


def stored(view: RangeView) -> dict[str, object]:
    """The arrays of a view, as others write them."""
    return {
        "depth": view.depth, "kind": view.kind, "unit": view.unit, "distortion": np.array(view.distortion),
        "fx": view.fx, "fy": view.fy, "cx": view.cx - 0.5, "cy": view.cy - 0.5,
        "world_to_camera": IMAGE_AXES @ view.world_to_camera,
    }  # fmt: skip


@pytest.mark.parametrize(("kind", "lens"), [("z", "none"), ("range", "kinect"), ("height", "none")])
def test_depth_of_every_kind(kind: str, lens: str, path: Path) -> None:
    expected, points, _ = shape_view("sphere", kind, lens)
    arrays = stored(expected)
    if not LENSES[lens]:
        del arrays["distortion"]
    view = save(path, **arrays)
    assert (view.kind, view.unit, view.name, view.assumed) == (kind, "mm", "camera", "")
    assert view.positions() == pytest.approx(points, abs=1e-6)
    pose = np.linalg.inv(arrays.pop("world_to_camera"))
    fx, fy, cx, cy = (arrays.pop(name) for name in ("fx", "fy", "cx", "cy"))
    again = save(path, **arrays, intrinsics=[[fx, 0, cx], [0, fy, cy], [0, 0, 1]], pose=pose)
    assert again.positions() == pytest.approx(view.positions(), abs=1e-12)
    with open_scan(path) as scan:
        assert scan.unit == "mm"


def test_numbers_of_a_sensor_are_scaled(path: Path) -> None:
    depth = np.array([[0, 1500], [2000, 65535]], ">u2")
    view = save(path, depth=depth, depth_scale=1000, unit="m", fx=500, fy=500, cx=0.5, cy=0.5)
    assert view.depth.tolist() == [[0, 1.5], [2, np.float32(65.535)]]
    assert view.valid().tolist() == [[False, True], [True, True]]
    assert (view.cx, view.cy) == (1, 1)
    assert np.array_equal(view.world_to_camera, np.eye(4))


def test_colours_mask_and_confidence(path: Path) -> None:
    colors = np.random.default_rng(1).integers(0, 256, (3, 4, 3), np.uint8)
    given = {"depth": np.ones((3, 4)), "mask": np.arange(12).reshape(3, 4) * 0.005}
    view = save(path, **given, color=colors, confidence=np.arange(12).reshape(3, 4), fx=9, fy=9, cx=2, cy=1)
    assert np.array_equal(view.color, colors)
    assert np.array_equal(view.mask, given["mask"] > 0.01)
    assert view.confidence.tolist() == np.arange(12.0).reshape(3, 4).tolist()
    for other in (colors / 255, np.dstack([colors, colors[..., :1]]), (colors / 255).astype(np.float32)):
        assert np.array_equal(save(path, **given, color=other).color, colors)
    grey = save(path, **given, color=colors[..., 0]).color
    assert np.array_equal(grey, colors[..., :1].repeat(3, axis=2))


def test_without_a_calibration_one_is_assumed_and_told(path: Path) -> None:
    view = save(path, depth=np.ones((3, 4)))
    assert "45 degrees" in view.assumed
    assert view.fx == pytest.approx(2 / np.tan(np.radians(22.5)))


def test_points_come_first(path: Path) -> None:
    np.savez(path, positions=np.eye(3), depth=np.ones(3), xyz=np.ones(3), elevation=np.ones(3))
    cloud = formats.read(path)
    assert isinstance(cloud, PointCloud)
    assert [*cloud.scalars] == ["depth", "xyz", "elevation"]


def test_a_grid_of_a_camera(path: Path) -> None:
    row, column = np.mgrid[:97, :121].astype(float)
    points, _ = camera_points("sphere", (column - 60) / 110, (48 - row) / 110, "z")
    grid = (points * (1, -1, -1)).astype(np.float32)
    seen = np.isfinite(grid).all(axis=2)
    pose = np.eye(4)
    pose[:3, 3] = 1, 2, 3
    colors = np.random.default_rng(2).integers(0, 256, (97, 121, 3), np.uint8)
    view = save(path, xyz=grid, color=colors, unit="m")
    assert (view.name, view.unit, view.xy) == ("camera", "m", None)
    assert view.positions() == pytest.approx(points[seen], abs=1e-5)
    assert np.array_equal(view.color, colors)
    moved = save(path, xyz=grid, pose=pose)
    assert moved.positions() == pytest.approx(grid[seen] + (1, 2, 3), abs=1e-5)


@pytest.mark.parametrize("lowest_first", [False, True])
def test_a_grid_of_a_scanner(lowest_first: bool, path: Path) -> None:
    """x to the right, y up, z towards the scanner, whichever row comes first."""
    row, column = np.mgrid[:40, :60].astype(float)
    x, y = 0.5 * column + np.sin(row / 7), 0.7 * (40 - row)
    grid = np.stack([x, y, 0.1 * x + np.cos(y / 9)], axis=2).astype(np.float32)
    grid[5, 6] = np.nan
    numbers = np.arange(2400).reshape(40, 60)
    order = slice(None, None, -1 if lowest_first else 1)
    view = save(path, xyz=grid[order], confidence=numbers[order], mask=numbers[order] != 77)
    seen = np.isfinite(grid).all(axis=2) & (numbers != 77)
    assert (view.kind, view.name) == ("height", "scanner")
    assert view.positions() == pytest.approx(grid[seen], abs=1e-5)
    assert np.array_equal(view.confidence[view.valid()], numbers[seen])
    assert view.normals()[:, 2].min() > 0.8
    pose = np.eye(4)
    pose[:3, 3] = 7, 8, 9
    assert save(path, xyz=grid, pose=pose).positions() == pytest.approx(
        grid[np.isfinite(grid).all(axis=2)] + (7, 8, 9), abs=1e-5
    )


def test_a_terrain_by_its_cells(path: Path) -> None:
    heights = np.arange(12.0).reshape(3, 4)
    heights[1, 1] = np.nan
    colors = np.arange(36, dtype=np.uint8).reshape(3, 4, 3)
    view = save(path, elevation=heights, dx=2.0, dy=5.0, unit="m", color=colors)
    points = view.positions()
    assert len(points) == 11
    assert points[0].tolist() == [1, -2.5, 0]
    assert points[-1].tolist() == [7, -12.5, 11]
    assert np.array_equal(view.color, colors)
    edges = {"xmin": 10, "xmax": 18, "ymin": 100, "ymax": 115}  # the first row is the southern one
    view = save(path, elevation=heights, **edges, color=colors)
    assert view.positions()[-1].tolist() == [17, 102.5, 3]
    assert np.array_equal(view.color, colors[::-1])
    assert view.unit == "units"


K = np.array([[30, 0, 15.5], [0, 30, 11.5], [0, 0, 1.0]])
DEPTH = (1 + np.add.outer(np.arange(24), np.arange(32)) / 100).astype(np.float32)
DEPTHS = np.stack([DEPTH, DEPTH + 1, DEPTH + 2])
POSES = np.tile(np.eye(4), (3, 1, 1))
POSES[:, 0, 3] = 0, 1, 2
RED = np.zeros((24, 32, 3), np.uint8)
RED[..., 0] = 255
OTHER_K = K * [[0.5], [0.5], [1]]


@pytest.mark.parametrize(
    "arrays",
    [
        {"depth": DEPTHS, "intrinsics": K},
        {"depth": DEPTHS, "K": np.stack([OTHER_K, OTHER_K, K])},
        {"depth": DEPTHS, "K": np.stack([OTHER_K.T, OTHER_K.T, K.T])},
        {"depths": DEPTHS, "intrinsic": np.stack([K] * 3)},
        {"Depth": DEPTHS, "camera_matrix": K},
        {"depth_map": DEPTHS[..., None], "cam_K": K.ravel()},
        {"depth": DEPTHS[:, None], "intrinsics": np.array([30, 30, 15.5, 11.5])},
        {"depth": DEPTHS[None, ..., None], "intrinsic": np.stack([K] * 3)[None]},
        {"depth": DEPTHS, "intrinsics": np.array([[60, 60, 9, 9], [60, 60, 9, 9], [30, 30, 15.5, 11.5]])},
        {"depth": DEPTHS, "fx": np.full(3, 30), "fy": 30, "cx": np.full((3, 1), 15.5), "cy": 11.5},
        {"depth": DEPTHS, "K": K * [[2], [2], [1]] + [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]}
        | {"width": 64, "height": 48},
        {"depth": (DEPTHS * 1000).astype(">u2"), "K": K, "depth_scale": 0.001},
        {"depth": np.asfortranarray(DEPTHS), "K": np.asfortranarray(K)},
    ],
)
def test_depths_of_several_frames(arrays: dict[str, np.ndarray], path: Path) -> None:
    """Cameras are one of all frames or one a frame, under the names of other programs."""
    np.savez(path, **arrays)
    with open_scan(path) as scan:
        assert len(scan) == 3
        (view,) = scan.pose(2).views
        assert scan.reading["camera"].source == "file"
    assert (view.fx, view.fy, view.cx, view.cy) == (30, 30, 16, 12)
    assert view.depth == pytest.approx(DEPTHS[2], abs=1e-3)


@pytest.mark.parametrize(
    ("name", "poses", "x"),
    [
        *[(name, POSES, 2) for name in ("pose", "poses", "cam2world", "c2w", "cam_c2w", "camera_to_world")],
        *[(name, POSES, -2) for name in ("w2c", "extrinsics", "world_to_camera")],
        ("extrinsic", POSES[:, :3], -2),
        ("extrinsic", POSES[None, :, :3], -2),
        ("pose", POSES[1], 1),
    ],
)
def test_poses_of_several_frames(name: str, poses: np.ndarray, x: float, path: Path) -> None:
    np.savez(path, depth=DEPTHS, K=K, **{name: poses})
    with open_scan(path) as scan:
        assert scan.pose(2).views[0].eye.tolist() == pytest.approx([x, 0, 0])
        assert ("extrinsics" in scan.reading.assumed) == name.startswith("extrinsic")


@pytest.mark.parametrize("name", ["extrinsics", "extrinsic"])
def test_extrinsics_may_lead_to_the_world(name: str, path: Path) -> None:
    np.savez(path, depth=DEPTHS, K=K, **{name: POSES})
    with open_scan(path) as scan:
        scan.pose(0)
        decision = scan.reading["extrinsics"]
        assert (decision.value, decision.alternatives) == ("to-camera", ("to-world",))
    with open_scan(path, read={"extrinsics": "to-world"}) as scan:
        assert scan.pose(2).views[0].eye.tolist() == pytest.approx([2, 0, 0])
        assert scan.reading["extrinsics"].source == "user"


@pytest.mark.parametrize(
    "colors",
    [
        {"color": RED},
        {"rgb": np.stack([RED] * 3)},
        {"images": np.stack([RED] * 3).transpose(0, 3, 1, 2)},
        {"images": np.stack([RED / 255] * 3)[None]},
        {"images": np.stack([RED.repeat(2, 0).repeat(2, 1)] * 3)},
    ],
)
def test_partners_of_several_frames(colors: dict[str, np.ndarray], path: Path) -> None:
    """Colours may have another size and their channels in front; times are those of points."""
    mask = np.tile(np.arange(32) < 16, (3, 24, 1))
    np.savez(path, depth=DEPTHS, K=K, **colors, mask=mask, depth_conf=DEPTHS, fps=50)
    with open_scan(path) as scan:
        assert scan.times.tolist() == pytest.approx([0, 0.02, 0.04])
        (view,) = scan.pose(1).views
    assert np.array_equal(view.color, RED)
    assert np.array_equal(view.mask, mask[0])
    assert np.array_equal(view.confidence, DEPTHS[1])


def test_colours_of_another_shape_are_left_out_and_told(path: Path) -> None:
    np.savez(path, depth=DEPTH, K=K, color=np.zeros((40, 90, 3), np.uint8))
    with open_scan(path) as scan:
        assert scan.pose(0).views[0].color is None
        assert [one.text for one in scan.messages] == [
            "Scan4D does not use the colours, because a picture has 90 x 40 pixels, but its depth picture "
            "has 32 x 24"
        ]
        assert scan.reading.unused


@pytest.mark.parametrize(
    ("arrays", "reason"),
    [
        ({"K": [[500, 0, 319.5], [0, 500, 239.5], [0, 0, 1]]}, "principal point 319.5, 239.5 of the camera"),
        (
            {"K": K, "width": 64, "height": 36},
            "the camera is for pictures of 64 x 36 pixels, but this picture has 32 x 24",
        ),
    ],
)
def test_cameras_of_another_picture(arrays: dict[str, object], reason: str, path: Path) -> None:
    np.savez(path, depth=DEPTH, **arrays)
    with pytest.raises(InputError, match=reason):
        formats.read(path)


def test_points_count_more_than_depth_without_a_camera(path: Path) -> None:
    """Point maps of networks have depths beside them, and all of them an axis of length 1 in front."""
    points = np.stack([np.dstack([*np.indices((24, 32)), depth]) for depth in DEPTHS])
    arrays = {"world_points": points[None], "depth": DEPTHS[None, ..., None]}
    np.savez(path, **arrays, images=np.full((1, 3, 3, 24, 32), 0.5))
    with open_scan(path) as scan:
        assert len(scan) == 3
        cloud = scan.pose(1).cloud
        assert len(cloud) == 768
        assert np.unique(cloud.colors[:, :3]).tolist() == [128]
    np.savez(path, **arrays, intrinsic=K)
    with open_scan(path) as scan:
        assert scan.pose(1).views[0].fx == 30


@pytest.mark.parametrize(
    ("arrays", "reason"),
    [
        ({"depth": np.ones(4)}, r"array 'depth' has shape \(4,\), expected \(H, W\)"),
        ({"depth": np.ones((0, 4))}, r"array 'depth' has shape \(0, 4\)"),
        ({"depth": np.ones((2, 2, 3))}, r"array 'depth' has shape \(2, 2, 3\)"),
        ({"xyz": np.ones((2, 2))}, r"array 'xyz' has shape \(2, 2\), expected \(H, W, 3\)"),
        ({"xyz": np.ones((2, 2, 3), int)}, "'xyz' is of type int64, expected floats"),
        ({"xyz": np.full((9, 9, 3), np.nan)}, "has only 0 points, too few for a surface"),
        ({"xyz": np.ones((9, 9, 3))}, "the points lie along a line"),
        ({"depth": np.ones((2, 2)), "mask": np.ones((2, 3))}, r"\(2, 3\), but 'depth' has shape \(2, 2\)"),
        ({"depth": np.ones((2, 2)), "color": np.ones((2, 2, 2))}, r"array 'color' has shape \(2, 2, 2\)"),
        ({"depth": np.full((2, 2), "a")}, "array 'depth' is of type <U1, expected numbers"),
        ({"depth": np.full((2, 2), None)}, "'depth' is of type object|pickled"),
        ({"depth": np.ones((2, 2)), "fx": 3}, "is not a calibration: it lacks fy, cx, cy"),
        ({"depth": np.ones((2, 2)), "kind": "height"}, "is not a calibration: it lacks fx, fy, cx, cy"),
        ({"depth": np.ones((2, 2)), "kind": "far"}, "unknown kind of depth 'far'"),
        ({"depth": np.ones((2, 2)), "kind": 3}, r"array 'kind' is \(\) int64, expected a word"),
        ({"depth": np.ones((2, 2)), "depth_scale": 0}, "the depth_scale is 0"),
        (
            {"depth": np.ones((2, 2)), "depth_scale": np.ones(2)},
            "is not a calibration: depth_scale is",
        ),
        (
            {"depth": np.ones((2, 2)), "intrinsics": np.eye(2)},
            "the matrix has shape .2, 2., expected 9 numbers",
        ),
        (
            {"depth": np.ones((2, 2)), "intrinsics": np.zeros((3, 3))},
            "is not a calibration: fx is 0 and fy 0",
        ),
        ({"depth": np.ones((2, 2)), "pose": np.eye(3)}, "'pose' is .3, 3. float64, expected 16 numbers"),
        ({"depth": np.ones((2, 2)), "pose": 2 * np.eye(4)}, "the pose is not a rotation and a translation"),
        ({"depth": np.ones((2, 2)), "world_to_camera": np.zeros((4, 4))}, "the pose is not a rotation"),
        (
            {"depth": np.ones((2, 2)), "distortion": np.ones(2000)},
            "'distortion' is .2000,. float64",
        ),
        (
            {"depth": np.ones((2, 2)), "distortion": np.ones(3)},
            "has 3 distortion coefficients, expected 4, 5 or 8",
        ),
        ({"elevation": np.ones((2, 2))}, "no ground coordinates. Add the arrays dx and dy"),
        ({"elevation": np.ones((2, 2)), "dx": 0, "dy": 1}, "the cells have the unusable size 0 x -1"),
        (
            {"normals": np.ones((2, 3))},
            r"has no array of points, only: normals \(2, 3\). Name points 'positions'",
        ),
    ],
)
def test_arrays_that_do_not_fit(arrays: dict[str, object], reason: str, path: Path) -> None:
    np.savez(path, **arrays)
    with pytest.raises(InputError, match=reason) as caught:
        formats.read(path)
    assert str(caught.value).startswith(str(path))


def test_what_unpacks_to_too_much_is_refused(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    np.savez_compressed(path, depth=np.ones((2000, 2000), np.float32))
    monkeypatch.setenv(READ_VARIABLE, "20")
    with pytest.raises(
        InputError, match=rf"would need .* MB of memory, .* set the environment variable {READ_VARIABLE}="
    ):
        formats.read(path)
    whole = path.read_bytes()
    for size in range(0, len(whole), max(1, len(whole) // 20)):
        path.write_bytes(whole[:size])
        with pytest.raises(InputError):
            formats.read(path)


def test_a_fault_in_the_rocks(data_dir: Path) -> None:
    file = data_dir / "range/terrain/jacksboro_fault_dem.npz"
    with np.load(file) as stored_arrays:
        heights, dx = stored_arrays["elevation"], float(stored_arrays["dx"])
    with open_scan(file) as scan:
        assert scan.unit == "m"
        (view,) = scan.pose(0).views
        assert scan.messages == []
    assert (view.kind, view.unit, view.depth.shape) == ("height", "m", (344, 403))
    assert np.array_equal(-view.depth, heights)  # ymin, of the first row, is the northern edge
    assert 1 / view.fx == pytest.approx(111_320 * np.cos(np.radians(36.59)) * dx, rel=2e-3)
    assert view.positions()[:, 2].max() == 1076
    assert view.normals()[:, 2].min() > 0


@pytest.mark.slow
def test_a_scan_of_a_laser(data_dir: Path) -> None:
    file = data_dir / "range/stanford_bunny_scans/bun000.npz"
    with np.load(file) as stored_arrays:
        grid = stored_arrays["xyz"]
    (view,) = formats.read(file)
    seen = np.isfinite(grid).all(axis=2)
    assert np.array_equal(view.valid(), seen[::-1])  # the lowest row came first
    assert view.positions() == pytest.approx(grid[::-1][seen[::-1]], abs=1e-7)
    facing = view.normals()[:, 2]
    assert np.mean(facing > 0) == 1
