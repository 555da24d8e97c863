"""A stereo pair of Middlebury's: depth from disparity."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from depth_folders import seen_points, write_color

from viewer.errors import InputError
from viewer.scan.open import find_source, open_scan

NUMBERS = {
    "focal_length_px": 100.0,
    "principal_point_left_x_px": 1.5,
    "principal_point_y_px": 1.0,
    "principal_point_dx_px": 3.0,
    "baseline_mm": 200.0,
}
COLORS = np.arange(18, dtype=np.uint8).reshape(2, 3, 3)


def put(folder: Path, disparity: object = ((7, np.inf, -3), (17, 0, np.nan))) -> Path:
    (folder / "calibration.json").write_text(json.dumps(NUMBERS))
    np.savez(folder / "cup_disp.npz", disparity=np.array(disparity, np.float32))
    write_color(folder / "cup_left.png", COLORS)
    write_color(folder / "cup_right.png", COLORS)
    return folder


def test_depth_is_baseline_and_focal_length_over_disparity(tmp_path: Path) -> None:
    put(tmp_path)
    with open_scan(tmp_path) as scan:
        assert (len(scan), scan.unit, scan.label(0)) == (1, "mm", "cup_disp.npz")
        (view,) = scan.pose(0).views
    depth = [[20000 / 10, 0, 0], [20000 / 20, 20000 / 3, 0]]
    np.testing.assert_allclose(view.positions(), seen_points(depth, (100, 100, 1.5, 1)), rtol=1e-6)
    np.testing.assert_array_equal(view.color, COLORS)


def test_the_picture_may_be_missing(tmp_path: Path) -> None:
    put(tmp_path)
    (tmp_path / "cup_left.png").unlink()
    assert find_source(tmp_path).load(0)[0].color is None


def test_what_is_wrong_is_told(tmp_path: Path) -> None:
    put(tmp_path, [1, 2, 3])
    with pytest.raises(InputError, match="cup_disp"):
        find_source(tmp_path).load(0)
    (tmp_path / "calibration.json").write_text("{}")
    with pytest.raises(InputError, match="focal_length_px"):
        find_source(tmp_path)
    put(tmp_path)
    (tmp_path / "calibration.json").write_text(json.dumps(NUMBERS | {"focal_length_px": -1}))
    with pytest.raises(InputError, match="calibration"):
        find_source(tmp_path).load(0)


def test_a_real_pair(data_dir: Path) -> None:
    with open_scan(data_dir / "range" / "middlebury_motorcycle_stereo") as scan:
        (view,) = scan.pose(0).views
    valid = view.valid()
    assert valid.mean() == pytest.approx(0.927, abs=5e-4)
    assert 2000 < view.depth[valid].min() < view.depth[valid].max() < 5100  # mm
