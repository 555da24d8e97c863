"""`scan4d asymmetry`: planes, values, statistics and report, and what it refuses."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from hill_folders import turning_hills


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, with three frames of a patch that turns."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    turning_hills("seq", 2500)
    return tmp_path


def table(path: str) -> list[dict[str, str]]:
    with open(path, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def mirror_patch(folder: str, count: int = 3) -> None:
    """Frames of a patch that is symmetric in x = 2, but for a bump of 0.4 that grows on the right."""
    Path(folder).mkdir()
    rng = np.random.default_rng(1)
    for frame in range(count):
        x, y = rng.uniform(-20, 20, (2, 4000))
        z = 6 * np.exp(-((np.abs(x) - 9) ** 2 + (y - 4) ** 2) / 30) + 8 * np.exp(-(x**2 + (y + 5) ** 2) / 40)
        z += 0.2 * frame * np.exp(-((x - 8) ** 2 + (y + 12) ** 2) / 12)
        np.savetxt(f"{folder}/{frame}.xyz", np.stack([x + 2, y, z], axis=1))


def test_the_plane_and_the_growing_asymmetry_are_found(run: Run) -> None:
    mirror_patch("face")
    done = run("asymmetry", "face", "--unit", "mm", "--up", "+y", "-o", "out")
    assert done.code == 0, done.err
    names = ("asymmetry.csv", "report.json", "0001.npz", "0002.npz", "0003.npz")
    assert done.out.endswith("".join(f"out/{name}\n" for name in names))
    rows = table("out/asymmetry.csv")
    assert list(rows[0]) == ["frame", "time", "rms", "share", "nx", "ny", "nz", "d"]
    for row in rows:
        normal = np.array([float(row[name]) for name in ("nx", "ny", "nz")])
        assert normal @ [1, 0, 0] > np.cos(np.radians(0.3))
        assert float(row["d"]) == pytest.approx(2, abs=0.1)
        assert float(row["share"]) > 0.8
    rms = [float(row["rms"]) for row in rows]
    assert rms[0] < rms[1] < rms[2]
    value = np.load("out/0003.npz")["value"]
    assert value.dtype == np.float32
    assert value.shape == (4000,)
    points = np.loadtxt("face/2.xyz")
    at_bump = np.linalg.norm(points[:, :2] - [10, -12], axis=1) < 1
    opposite = np.linalg.norm(points[:, :2] - [-6, -12], axis=1) < 1
    assert 0.2 < np.abs(np.median(value[at_bump])) < 0.45
    assert np.median(value[at_bump]) == pytest.approx(-np.median(value[opposite]), abs=0.1)
    report = json.loads(Path("out/report.json").read_text())
    assert set(report["mid_planes"]) == {"1", "2", "3"}
    assert "The asymmetry is largest in frame 3" in done.out
    # The region carries the plane of the first frame along.
    Path("region.json").write_text('{"spheres": [[2, 4, 3, 14]]}')
    carried = run("asymmetry", "face", "--unit", "mm", "--up", "+y", "--region", "region.json", "-o", "upper")
    assert carried.code == 0, carried.err
    assert float(table("upper/asymmetry.csv")[2]["d"]) == pytest.approx(2, abs=0.1)
    assert json.loads(Path("upper/report.json").read_text())["rigid"]["region"]["points"] > 100
    assert not Path("upper/transforms.partial").exists()


def test_a_frame_that_cannot_be_read_has_an_empty_row_and_a_reason(run: Run) -> None:
    mirror_patch("face", 2)
    Path("face/1.xyz").write_text("no numbers here\n")
    done = run("asymmetry", "face", "-o", "out")
    assert done.code == 0, done.err
    assert table("out/asymmetry.csv")[1]["rms"] == table("out/asymmetry.csv")[1]["nx"] == ""
    assert "1 of 2 frames have no values, such as frame 2" in done.err
    assert not Path("out/0002.npz").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("seq", "--region", "nowhere.json"), "nowhere.json"),
        (("seq", "--reach", "-1"), "not a positive length"),
        (("nowhere.ply",), "nowhere.ply"),
    ],
)
def test_what_cannot_be_done_is_one_message(run: Run, words: tuple[str, ...], message: str) -> None:
    done = run("asymmetry", *words, "-o", "out")
    assert done.code != 0
    assert message in done.err
    assert "Traceback" not in done.err
