"""Frames without points: pictures and films show the background, and everything else leaves them out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from written import film, film_times, picture

from viewer.document.recording import Recording
from viewer.errors import EmptyFrame
from viewer.scan.open import open_scan

SMALL = ("--size", "96x64", "--look", "background=#102030")
BACKGROUND = (0x10, 0x20, 0x30)
PLY = (
    "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
    "end_header\n"
)
PCD = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\nHEIGHT 1\nPOINTS {0}\nDATA ascii\n"


def write_frame(path: Path, points: np.ndarray) -> None:
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in points)
    match path.suffix:
        case ".npy":
            np.save(path, points)
        case ".npz":
            np.savez(path, positions=points)
        case ".obj":
            path.write_text("# a mesh\n" + "".join(f"v {row}\n" for row in rows.splitlines()))
        case ".xyz":
            path.write_text(f"# a cloud\n{rows}")
        case ".csv":
            path.write_text("x,y,z\n" + rows.replace(" ", ","))
        case ".pcd":
            path.write_text(PCD.format(len(points)) + rows)
        case _:
            path.write_text(PLY.format(len(points)) + rows)


@pytest.fixture(params=[".ply", ".pcd", ".npy", ".npz", ".obj", ".xyz", ".csv"])
def scan(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Four frames, of which the first and the third are empty."""
    points = np.random.default_rng(0).normal(size=(400, 3))
    folder = tmp_path / "scan"
    folder.mkdir()
    for number in range(4):
        write_frame(folder / f"f{number}{request.param}", points[: 400 * (number % 2)])
    return folder


def is_background(image: np.ndarray) -> bool:
    return bool((np.abs(image[..., :3].astype(int) - BACKGROUND) <= 4).all())


def test_a_timeline_tells_empty_frames_from_broken_ones(scan: Path) -> None:
    with open_scan(scan) as timeline:
        assert [pose.index for pose in timeline] == [1, 3]
        assert timeline.empty == {0, 2}
        with pytest.raises(EmptyFrame):
            timeline.pose(2)
        assert [timeline.drawn(index).count for index in range(4)] == [0, 400, 0, 400]
        assert timeline.drawn(2).time == timeline.times[2]
        assert {one.kind for one in timeline.messages} == {"empty"}


def test_a_picture_of_one_empty_frame_shows_the_background(scan: Path, run: Run, tmp_path: Path) -> None:
    for more in ((), ("--no-gl",)):
        done = run("render", scan, "--pose", 2, *SMALL[:2], *more, "-o", tmp_path / "p.png", "--force")
        assert done.code == 0, done.err
        assert "empty picture for frame 3" in done.err
        assert len(np.unique(picture(tmp_path / "p.png").reshape(-1, 4)[:, :3], axis=0)) == 1


def test_films_and_pictures_show_the_background(scan: Path, run: Run, tmp_path: Path) -> None:
    done = run("render", scan, "--all", *SMALL, "-o", tmp_path / "a.mp4")
    assert done.code == 0, done.err
    assert "empty picture for frame 1" in done.err
    assert film_times(tmp_path / "a.mp4")[0] == pytest.approx([0, 0.04, 0.08, 0.12], abs=1e-4)
    assert [is_background(image) for image in film(tmp_path / "a.mp4")[0]] == [True, False, True, False]
    assert run("render", scan, "--all", *SMALL, "-o", tmp_path / "p%d.png").code == 0
    assert [is_background(picture(tmp_path / f"p{n}.png")) for n in range(4)] == [True, False, True, False]


@pytest.mark.parametrize("more", [("--no-gl",), ("--anonymous",), ("--turntable", 4), ("--marks", "stamp")])
def test_every_kind_of_film_has_all_frames(more: tuple[object, ...], run: Run, tmp_path: Path) -> None:
    points = np.random.default_rng(0).normal(size=(400, 3))
    for number in range(3):
        write_frame(tmp_path / f"f{number}.ply", points[: 400 * (number != 1)])
    assert run("render", tmp_path, "--all", *SMALL, *more, "-o", tmp_path / "a.mp4").code == 0
    assert film_times(tmp_path / "a.mp4")[0] == pytest.approx([0, 0.04, 0.08], abs=1e-4)


@pytest.mark.parametrize("more", [(), ("--anonymous",)])
def test_a_replay_shows_the_background(more: tuple[object, ...], run: Run, tmp_path: Path) -> None:
    points = np.random.default_rng(0).normal(size=(400, 3))
    scan = tmp_path / "scan"
    scan.mkdir()
    for number in range(3):
        write_frame(scan / f"f{number}.ply", points[: 400 * (number != 1)])
    assert run("render", scan, "--all", *SMALL, "-o", tmp_path / "p%d.png").code == 0
    entries = [Recording.load(tmp_path / f"p{number}.png").entries[0] for number in range(3)]
    assert [entry.pose for entry in entries] == [0, 1, 2]
    assert run("render", "--replay", tmp_path / "p1.png", *more, "-o", tmp_path / "again.png").code == 0
    assert is_background(picture(tmp_path / "again.png"))


def test_info_counts_them_apart_and_a_scan_of_nothing_is_refused(run: Run, tmp_path: Path) -> None:
    points = np.random.default_rng(0).normal(size=(400, 3))
    write_frame(tmp_path / "f0.ply", points[:0])
    write_frame(tmp_path / "f1.ply", points)
    assert json.loads(run("info", tmp_path, "--json").out)["unreadable"] == 0
    write_frame(tmp_path / "f1.ply", points[:0])
    done = run("render", tmp_path, "--all", *SMALL, "-o", tmp_path / "a.mp4")
    assert done.code == 2
    assert not (tmp_path / "a.mp4").exists()
    assert run("render", tmp_path / "f0.ply", *SMALL, "-o", tmp_path / "a.png").code == 2
