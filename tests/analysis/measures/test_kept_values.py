"""Values that are kept: found once, and again where anything that they are made of has changed."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from scenes import rarely
from shapes import Frames, sphere_points, track_of

from viewer import folders
from viewer.analysis.measures import Measure, kept
from viewer.analysis.measures.series import all_series
from viewer.scan.points import PointCloud

R = 20.0
MEASURES = [Measure("cheek", "area", ("a", "b", "c")), Measure("off", "path", ("a", "d"))]
PLACES = {"a": (1.0, 0, 0), "b": (0.8, 0.6, 0), "c": (0.8, 0, 0.6), "d": (3.0, 0, 0)}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for module in (kept, folders):
        monkeypatch.setattr(module, "cache_folder", lambda: tmp_path)
    return tmp_path / "measures"


def sphere_cloud(seed: int) -> PointCloud:
    points = sphere_points(3000, R, seed=seed)
    return PointCloud.from_arrays(points, normals=points / R)


def series(clouds: list[PointCloud], measures: list[Measure] = MEASURES, shift: float = 0.0) -> dict:
    tracks = {name: track_of([tuple(R * np.array(at) + shift)] * len(clouds)) for name, at in PLACES.items()}
    with Frames(clouds).timeline() as timeline:
        return all_series(measures, tracks, timeline, keep=True)


def spoil(folder: Path) -> None:
    """Change each kept value, so that one that is taken from a file is known by it."""
    for path in folder.glob("*.json"):
        held = json.loads(path.read_text())
        for value in held.values():
            if "value" in value:
                value["value"] = 1234.5
        path.write_text(json.dumps(held))


def test_values_are_taken_from_where_they_were_kept(folder: Path) -> None:
    clouds = [sphere_cloud(0), sphere_cloud(1)]
    first, again = series(clouds), series(clouds)
    for name in ("cheek", "off"):
        np.testing.assert_array_equal(first[name].values, again[name].values)
        np.testing.assert_array_equal(first[name].sigmas, again[name].sigmas)
        assert first[name].reasons == again[name].reasons
    np.testing.assert_array_equal(first["cheek"].lines[1][0], again["cheek"].lines[1][0])
    assert again["off"].reasons == {0: "d is off the surface", 1: "d is off the surface"}
    spoil(folder)
    assert series(clouds)["cheek"].values.tolist() == [1234.5, 1234.5]


def test_what_has_changed_is_found_again(folder: Path) -> None:
    clouds = [sphere_cloud(0), sphere_cloud(1)]
    true = series(clouds)["cheek"].values
    spoil(folder)
    changed = series([clouds[0], sphere_cloud(2)])["cheek"].values
    assert changed[0] == 1234.5
    assert changed[1] == pytest.approx(true[1], rel=0.02)
    assert series(clouds, shift=0.01)["cheek"].values == pytest.approx(true, rel=0.02)
    through = [Measure("cheek", "area", ("a", "b", "c"), {"depth": "through"})]
    assert series(clouds, through)["cheek"].values != pytest.approx(1234.5)


@pytest.mark.parametrize("text", [*rarely("", "[]", '{"0": 7}'), '{"0": {"surface": "x"}}', "{" * 100_000])
def test_damaged_files_are_none(folder: Path, text: str) -> None:
    clouds = [sphere_cloud(0)]
    true = series(clouds)["cheek"].values
    for path in folder.glob("*.json"):
        path.write_text(text)
    np.testing.assert_array_equal(series(clouds)["cheek"].values, true)


def test_only_this_user_reads_them_and_the_oldest_go(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    series([sphere_cloud(0)])
    files = sorted(folder.glob("*.json"))
    assert len(files) == 2
    for path in files:
        os.utime(path, (1, 1))
    most = int(1.2 * sum(path.stat().st_size for path in files))
    monkeypatch.setattr(kept, "_MOST_IN_ALL", most)
    series([sphere_cloud(0)], shift=0.01)
    left = set(folder.glob("*.json"))
    assert sum(path.stat().st_size for path in left) <= most
    assert len(left - set(files)) == 2
    assert not set(files) <= left
    assert {path.stat().st_mode & 0o777 for path in left} <= {0o600}
