"""Every flag of the command line, its messages and exit codes, on real files and OpenGL."""

from __future__ import annotations

import json
import logging
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest
from command_line import Done, Run
from numpy.typing import NDArray
from scenes import sphere
from written import bits, film, picture

import viewer
from viewer import cli, frame
from viewer.backends import backends
from viewer.camera import Camera
from viewer.commands import _drawing as drawing
from viewer.commands import command_names
from viewer.errors import NoOpenGLError
from viewer.gpu.surface import NOTHING
from viewer.look import Look
from viewer.renderer import Renderer
from viewer.scan import formats
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud

ROOT = Path(__file__).resolve().parents[2]
SMALL = ("--size", "96x64")
FRAMES = 5


def process(*argv: object, **environment: str) -> subprocess.Popen[str]:
    """A command line in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "viewer.cli", *map(str, argv)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        env={**os.environ, **environment},
    )


def finish(running: subprocess.Popen[str]) -> Done:
    out, err = running.communicate()
    assert "Traceback" not in err
    return Done(running.returncode, out, err)


def cloud_at(index: int) -> PointCloud:
    """Frame of a ball that grows."""
    return sphere(2000, radius=1 + 0.1 * index)


@pytest.fixture(scope="session")
def scans(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ball.npz, and five frames in sequence/ and, number 2 damaged, in broken/."""
    folder = tmp_path_factory.mktemp("scans")
    formats.write(folder / "ball.npz", cloud_at(0))
    for name in ("sequence", "broken"):
        (folder / name).mkdir()
        for index in range(FRAMES):
            formats.write(folder / name / f"f{index:02d}.npz", cloud_at(index))
    (folder / "broken" / "f02.npz").write_bytes(b"PK\x03\x04 and then nothing")
    return folder


def stored(path: Path) -> dict[str, NDArray]:
    with np.load(path) as arrays:
        return dict(arrays)


def names(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


def front(cloud: PointCloud, **options: object) -> Camera:
    return Camera.orbit(cloud.bounds(), aspect=96 / 64, **options)  # type: ignore[arg-type]


# --- render: one picture --------------------------------------------------------------------


def test_a_picture_is_what_the_library_draws(run: Run, scans: Path, tmp_path: Path) -> None:
    done = run("render", scans / "ball.npz", "-o", tmp_path / "a.png", *SMALL)
    assert done == (0, f"{tmp_path / 'a.png'}\n", "")
    cloud = formats.read(scans / "ball.npz")
    surface = viewer.render(cloud, front(cloud), (96, 64), "surfels")
    assert np.array_equal(picture(tmp_path / "a.png"), surface.image())
    assert names(tmp_path) == ["a.png"]


def test_the_default_size(run: Run, scans: Path, tmp_path: Path) -> None:
    assert run("render", scans / "ball.npz", "-o", tmp_path / "a.png").code == 0
    assert picture(tmp_path / "a.png").shape == (1280, 1920, 4)


def test_backend_parameters_and_look(run: Run, scans: Path, tmp_path: Path) -> None:
    arguments = ["render", scans / "ball.npz", *SMALL, "--backend", "points"]
    look = ("--look", "color_by=height", "low=-1", "--look", "background=#ff0000")
    done = run(*arguments, "-o", tmp_path / "a.npz", "--set", "point_size=3", *look)
    assert done.code == 0
    cloud = formats.read(scans / "ball.npz")
    expected = Look(color_by="height", low=-1.0, background="#ff0000")
    surface = frame.render(cloud, front(cloud), (96, 64), "points", expected, {"point_size": 3})
    for name, array in stored(tmp_path / "a.npz").items():
        assert np.array_equal(bits(array), bits(surface.arrays()[name])), name
    assert run(*arguments, "-o", tmp_path / "a.png", "--look", "background=#ff0000").code == 0
    assert tuple(picture(tmp_path / "a.png")[0, 0]) == (255, 0, 0, 255)


def test_exr_output(run: Run, scans: Path, tmp_path: Path) -> None:
    import OpenEXR

    assert run("render", scans / "ball.npz", "-o", tmp_path / "a.exr", *SMALL).code == 0
    cloud = formats.read(scans / "ball.npz")
    surface = viewer.render(cloud, front(cloud), (96, 64), "surfels")
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        assert np.array_equal(file.channels()["Z"].pixels, surface.depth)


@pytest.mark.parametrize(
    ("argument", "azimuth", "elevation", "distance"),
    [("30,15", 30, 15, None), ("-30,15", -30, 15, None), ("-.5,-20,7.5", -0.5, -20, 7.5)],
)
@pytest.mark.parametrize("up", ["+y", "-z"])
def test_orbit_and_up(
    argument: str, azimuth: float, elevation: float, distance: float | None, up: str, run: Run, scans: Path,
    tmp_path: Path,
) -> None:  # fmt: skip
    ball = ("render", scans / "ball.npz", "-o", tmp_path / "a.png", *SMALL)
    assert run(*ball, "--up", up, "--orbit", argument).code == 0
    cloud = formats.read(scans / "ball.npz")
    camera = front(cloud, azimuth=azimuth, elevation=elevation, distance=distance, up=up)
    expected = viewer.render(cloud, camera, (96, 64), "surfels").image()
    assert np.array_equal(picture(tmp_path / "a.png"), expected)
    assert run(*ball, f"--up={up}", f"--orbit={argument}", "--force").code == 0
    assert np.array_equal(picture(tmp_path / "a.png"), expected)


def test_a_camera_file(run: Run, scans: Path, tmp_path: Path) -> None:
    camera = Camera(eye=(2, 3, 4), target=(0, 0.1, 0), projection="orthographic", height=3.0)
    camera.save(tmp_path / "camera.json")
    done = run(
        "render", scans / "ball.npz", "-o", tmp_path / "a.png", *SMALL, "--camera", tmp_path / "camera.json"
    )
    assert done.code == 0
    cloud = formats.read(scans / "ball.npz")
    expected = viewer.render(cloud, camera, (96, 64), "surfels").image()
    assert np.array_equal(picture(tmp_path / "a.png"), expected)


def test_a_pose_by_number_and_by_time(run: Run, scans: Path, tmp_path: Path) -> None:
    sequence = ("render", scans / "sequence", *SMALL, "-o")
    assert run(*sequence, tmp_path / "pose.png", "--pose", 3).code == 0
    assert run(*sequence, tmp_path / "time.png", "--time", 0.31, "--fps", 10).code == 0
    assert run(*sequence, tmp_path / "first.png").code == 0
    cloud = formats.read(scans / "sequence" / "f03.npz")
    expected = viewer.render(cloud, front(cloud), (96, 64), "surfels").image()
    assert np.array_equal(picture(tmp_path / "pose.png"), expected)
    assert np.array_equal(picture(tmp_path / "time.png"), expected)
    assert not np.array_equal(picture(tmp_path / "first.png")[..., 3:], expected)


def test_the_demo_is_drawn_where_no_scan_is_named(run: Run, tmp_path: Path) -> None:
    assert run("render", "-o", tmp_path / "a.npz", *SMALL).code == 0
    assert run("render", "demo", "-o", tmp_path / "b.npz", *SMALL).code == 0
    a, b = stored(tmp_path / "a.npz"), stored(tmp_path / "b.npz")
    assert (a["id"] != NOTHING).mean() > 0.1
    assert all(np.array_equal(bits(a[name]), bits(b[name])) for name in a)


# --- render: several pictures ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("choice", "numbers"),
    [
        (["--all"], [0, 1, 2, 3, 4]),
        (["--poses", "1:4"], [1, 2, 3]),
        (["--poses", ":"], [0, 1, 2, 3, 4]),
        (["--poses", "0:99:2"], [0, 2, 4]),
        (["--poses", "3:"], [3, 4]),
        (["--pose", "2"], [2]),
    ],
)
def test_numbered_pictures_bear_the_number_of_their_pose(
    choice: list[str], numbers: list[int], run: Run, scans: Path, tmp_path: Path
) -> None:
    assert run("render", scans / "sequence", "-o", tmp_path / "p%03d.npz", *SMALL, *choice).code == 0
    assert names(tmp_path) == [f"p{number:03d}.npz" for number in numbers]
    # One camera for all, which shows the largest whole: the ball grows in the picture.
    coverage = [stored(tmp_path / name)["coverage"].mean() for name in names(tmp_path)]
    assert coverage == sorted(set(coverage))
    last = formats.read(scans / "sequence" / f"f{numbers[-1]:02d}.npz")
    expected = viewer.render(last, front(last), (96, 64), "surfels")
    assert np.array_equal(stored(tmp_path / names(tmp_path)[-1])["depth"], expected.depth)


@pytest.mark.parametrize(("options", "rate"), [([], 25), (["--fps", "10"], 10), (["--poses", "0:5:2"], 12.5)])
def test_a_film_plays_at_the_pace_of_the_scan(
    options: list[str], rate: float, run: Run, scans: Path, tmp_path: Path
) -> None:
    choice = options if "--poses" in options else [*options, "--all"]
    done = run("render", scans / "sequence", "-o", tmp_path / "a.mp4", "--size", "95x63", *choice)
    assert done.code == 0
    frames, found = film(tmp_path / "a.mp4")
    assert found == rate
    assert len(frames) == (3 if "--poses" in options else FRAMES)
    assert {frame.shape for frame in frames} == {(64, 96, 3)}
    assert names(tmp_path) == ["a.mp4"]


def test_a_turntable_goes_round_and_never_cuts(run: Run, tmp_path: Path) -> None:
    # A plank: fitted from its narrow side alone, it would leave the picture from the broad one.
    x, y = np.meshgrid(np.linspace(-5, 5, 100), np.linspace(-1, 1, 20))
    plank = np.stack([np.zeros(x.size), y.ravel(), x.ravel()], axis=1)
    np.savez(tmp_path / "plank.npz", positions=plank)
    turn = ("--turntable", 4, "--backend", "points")
    done = run("render", tmp_path / "plank.npz", "-o", tmp_path / "t%d.npz", *SMALL, *turn)
    assert done.code == 0
    surfaces = [stored(tmp_path / f"t{k}.npz") for k in range(4)]
    seen = [surface["id"] != NOTHING for surface in surfaces]
    for found in seen:
        assert found.any()
        edge = np.concatenate([found[0], found[-1], found[:, 0], found[:, -1]])
        assert not edge.any()
    assert seen[0].sum() < seen[1].sum()
    # A quarter turn further, the eye has moved from +z to +x: the far end is now on the left.
    ends = [surfaces[1]["id"][:, column] for column in np.flatnonzero(seen[1].any(axis=0))[[0, -1]]]
    z = [plank[end[end != NOTHING], 2].mean() for end in ends]
    assert z[0] > 4
    assert z[1] < -4


def test_a_turntable_while_playing(run: Run, scans: Path, tmp_path: Path) -> None:
    sequence = ("render", scans / "sequence", *SMALL, "-o")
    assert run(*sequence, tmp_path / "p%d.npz", "--all", "--turntable", 4).code == 0
    assert names(tmp_path) == [f"p{k}.npz" for k in range(FRAMES)]
    cloud = formats.read(scans / "sequence" / f"f{FRAMES - 1:02d}.npz")  # the largest
    distance = max(front(cloud, azimuth=a).distance for a in (0, 90, 180, 270))
    camera = front(cloud, azimuth=270, distance=distance)
    expected = viewer.render(formats.read(scans / "sequence" / "f03.npz"), camera, (96, 64), "surfels")
    assert np.array_equal(stored(tmp_path / "p3.npz")["depth"], expected.depth)


def test_turntable_pictures_of_one_pose_are_counted(run: Run, scans: Path, tmp_path: Path) -> None:
    done = run("render", scans / "sequence", "--pose", 2, "-o", tmp_path / "a.mp4", *SMALL, "--turntable", 6)
    assert done.code == 0
    frames, rate = film(tmp_path / "a.mp4")
    assert (len(frames), rate) == (6, 25)


# --- broken frames --------------------------------------------------------------------------


def test_a_broken_frame_is_reported_and_the_rest_is_drawn(run: Run, scans: Path, tmp_path: Path) -> None:
    done = run("render", scans / "broken", "-o", tmp_path / "p%d.png", *SMALL, "--all")
    assert done.code == 0
    assert names(tmp_path) == ["p0.png", "p1.png", "p3.png", "p4.png"]
    assert re.fullmatch(r"scan4d: broken: frame 2 [^\n]*f02\.npz[^\n]*\n", done.err), done.err


def test_a_broken_frame_alone_is_an_error(refused: Callable[..., str], scans: Path, tmp_path: Path) -> None:
    assert "f02.npz" in refused("render", scans / "broken", "-o", tmp_path / "p.png", "--pose", 2)
    assert names(tmp_path) == []


@pytest.mark.parametrize("out", ["p%d.png", "p.mp4"])
def test_a_scan_of_broken_frames_alone_is_an_error(out: str, run: Run, tmp_path: Path) -> None:
    (tmp_path / "scan").mkdir()
    for index in range(3):
        (tmp_path / "scan" / f"f{index}.ply").write_bytes(b"ply\nformat ascii 1.0\nend_header\n")
    done = run("render", tmp_path / "scan", "-o", tmp_path / out, *SMALL, "--all")
    assert done.code == 2
    assert done.err.splitlines()[-1].endswith("none of its 3 frames can be read")
    assert names(tmp_path) == ["scan"]
    assert run("info", tmp_path / "scan").code == 2


def test_dropped_points_are_reported(run: Run, tmp_path: Path) -> None:
    positions = np.eye(3)
    positions[1, 1] = np.nan
    np.savez(tmp_path / "a.npz", positions=positions)
    done = run("render", tmp_path / "a.npz", "-o", tmp_path / "a.png", *SMALL)
    assert done.code == 0
    assert re.fullmatch(r"scan4d: a\.npz: [^\n]*\b1\b[^\n]*\n", done.err), done.err
    facts = json.loads(run("info", tmp_path / "a.npz", "--json").out)
    assert (facts["points"], facts["dropped"]) == (2, 1)


def test_a_scan_may_follow_parameters(run: Run, scans: Path, tmp_path: Path) -> None:
    ball, out = scans / "ball.npz", ("-o", tmp_path / "a.npz", *SMALL, "--backend", "points", "--force")
    assert run("render", ball, *out, "--set", "point_size=3", "--look", "light=flat", "up=+z").code == 0
    before = stored(tmp_path / "a.npz")
    assert run("render", *out, "--look", "light=flat", "up=+z", "--set", "point_size=3", ball).code == 0
    assert all(np.array_equal(bits(before[name]), bits(stored(tmp_path / "a.npz")[name])) for name in before)


def test_a_scan_may_follow_options_of_several_words(run: Run, scans: Path, tmp_path: Path) -> None:
    ball = scans / "ball.npz"
    marks = ("--marks", "stamp", "scale_bar")
    assert run("render", *marks, ball, "-o", tmp_path / "a.png", *SMALL).code == 0
    assert run("render", ball, "-o", tmp_path / "b.png", *SMALL, *marks).code == 0
    assert np.array_equal(picture(tmp_path / "a.png"), picture(tmp_path / "b.png"))
    (tmp_path / "mesh.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    pods = ("simulate", "--azimuths", -30, "10.5", tmp_path / "mesh.obj", "-o", tmp_path / "a.exr")
    assert run(*pods, "--size", "9x9").code == 0
    assert len(json.loads(run("info", tmp_path / "a.exr", "--json").out)["views"]) == 2


# --- stats ----------------------------------------------------------------------------------


@pytest.mark.parametrize("repeat", [None, 3])
def test_stats(repeat: int | None, renderer: Renderer, run: Run, scans: Path, tmp_path: Path) -> None:
    again = [] if repeat is None else ["--repeat", repeat]
    points = ("--backend", "points", "--set", "point_size=2")
    sequence = ("render", scans / "sequence", "--poses", "1:3", *SMALL, *points)
    done = run(*sequence, "-o", tmp_path / "p%d.npz", "--stats", tmp_path / "stats.json", *again)
    assert done.code == 0
    stats = json.loads((tmp_path / "stats.json").read_text())
    assert list(stats) == [
        "device", "timer", "backend", "params", "size", "frames", "bytes_gpu", "peak_rss",
    ]  # fmt: skip
    assert stats["device"] == renderer.gpu.device
    assert stats["timer"] in ("query", "finish")
    assert (stats["backend"], stats["params"], stats["size"]) == ("points", {"point_size": 2}, [96, 64])
    assert stats["bytes_gpu"] > 2000 * 12
    assert stats["peak_rss"] > 10e6
    assert [f["pose"] for f in stats["frames"]] == [1, 2]
    for f in stats["frames"]:
        assert list(f) == [
            "pose", "gpu_ms", "cpu_ms", "upload_ms", "derive_ms", "passes", "points", "skipped", "chosen",
        ]  # fmt: skip
        assert f["upload_ms"] > 0
        assert f["cpu_ms"] > 0
        assert len(f["passes"]) >= 2
        assert all(set(p) == {"name", "gpu_ms"} and p["gpu_ms"] >= 0 for p in f["passes"])
        assert f["gpu_ms"] > 0
        seen = stored(tmp_path / f"p{f['pose']}.npz")["id"]
        assert f["points"]["drawn"] == len(np.unique(seen[seen != NOTHING]))
        assert f["points"]["in"] == 2000
        assert f["points"]["culled"].keys() == {"dropped", "outside", "hidden"}
        assert f["points"]["in"] == f["points"]["drawn"] + sum(f["points"]["culled"].values())
    assert not renderer.gpu.timers.enabled


def test_repeat_draws_each_frame_so_often_after_two_warm_ups(
    run: Run, scans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from viewer import timing

    drawn: list[bool] = []
    draw = timing.draw

    def counted(renderer: Renderer, *rest: object) -> object:
        drawn.append(renderer.gpu.timers.enabled)
        return draw(renderer, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(timing, "draw", counted)
    ball = ("render", scans / "ball.npz", "-o", tmp_path / "a.png", *SMALL, "--stats", tmp_path / "s.json")
    assert run(*ball, "--repeat", 4).code == 0
    assert drawn == [False] * (2 + 4) + [True] * 4


# --- messages -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.ply"], ["nowhere.ply", "no such file"]),
        (["--pose", "5"], ["no pose 5", "0 to 4"]),
        (["--pose", "-1"], ["no pose -1"]),
        (["--pose", "x"], ["--pose", "'x'"]),
        (["--poses", "7:9"], ["7:9", "0 to 4"]),
        (["--poses", "2"], ["'2'", "A:B"]),
        (["--poses", "0:4:0"], ["0:4:0", "A:B"]),
        (["--poses", "-3:"], ["--poses"]),
        (["--all"], ["p%04d.png", "p.mp4"]),
        (["--turntable", "3"], ["p%04d.png", "p.mp4"]),
        (["--turntable", "0"], ["--turntable", "'0'"]),
        (["--all", "--pose", "1"], ["--pose", "--all"]),
        (["--orbit", "1,2", "--turntable", "3"], ["--turntable", "--orbit"]),
        (["--orbit", "1"], ["--orbit", "AZIMUTH,ELEVATION"]),
        (["--orbit", "1,nan"], ["--orbit", "AZIMUTH,ELEVATION"]),
        (["--orbit", "1,2,-3"], ["distance"]),
        (["--size", "12"], ["--size", "'12'", "1920x1280"]),
        (["--size", "0x5"], ["0x5"]),
        (["--size", "100000x100000"], ["too large", "--size"]),
        (["--backend", "nope"], ["'nope'", *backends()]),
        (["--backend", "points", "--set", "nope=1"], ["'nope'", "Known: point_size"]),
        (["--backend", "points", "--set", "point_size=-1"], ["point_size", "0 to 32"]),
        (["--backend", "points", "--set", "point_size=big"], ["point_size", "'big'"]),
        (["--set", "size"], ["'size'", "key=value"]),
        (["--look", "nope=1"], ["'nope'", "color_by", "background"]),
        (["--look", "color_by=nope"], ["'nope'", "depth", "height"]),
        (["--look", "background=red"], ["'red'", "#rrggbb"]),
        (["--camera", "nowhere.json"], ["nowhere.json"]),
        (["--repeat", "3"], ["--stats"]),
        (["--stats", "a.txt"], ["a.txt", ".json"]),
        (["--stats", "missing/a.json"], ["missing"]),
        (["-o", "p.jpg"], [".jpg", ".png", ".exr", ".npz", ".mp4"]),
        (["-o", "missing/p.png"], ["missing", "Create it"]),
        (["-o", "p%04d.mp4", "--all"], ["p%04d.mp4", "film"]),
        (["--up", "+w"], ["'+w'", "+x"]),
        (["--fps", "0"], ["frame rate"]),
        (["--fps", "fast"], ["--fps", "'fast'"]),
        (["--nope"], ["unknown option '--nope'", "'scan4d render --help'"]),
        (["--bac", "points"], ["unknown option '--bac'", "'--backend'"]),
        (["--bakend=points"], ["'--bakend'. Did you mean '--backend'?"]),
        (["--backend", "pionts"], ["Did you mean 'points'?"]),
        (["--backend", "points", "--set", "pointsize=2"], ["Did you mean 'point_size'?"]),
        (["--look", "colour_by=depth"], ["Did you mean 'color_by' or 'color_map'?"]),
        (["--look", "color_by=hight"], ["Did you mean 'height'?"]),
        (["--marks", "stmp"], ["--marks 'stmp'. Did you mean 'stamp'?"]),
        (["b.npz", "c.npz"], ["'b.npz', 'c.npz'", "takes SCAN", "quote it", "'scan4d render --help'"]),
        (["--marks", "stamp", "colr_bar"], ["--marks 'colr_bar'. Did you mean 'color_bar'"]),
        (["--camera", ""], ["after '--camera' is empty"]),
        (["--output="], ["after '--output=' is empty"]),
        (["-y"], ["unknown option '-y'"]),
        (["--unit", "m" * 5000], ["--unit", "no unit"]),
        (["--unit", "\x1b[31m"], [r"'\x1b[31m' is no unit"]),
        (["--backend", "\x1b]0;p\x07\n\u202e"], [r"'\x1b]0;p\x07\n\u202e'"]),
    ],
)
def test_unusable_arguments_are_one_message(
    arguments: list[str], words: list[str], refused: Callable[..., str], scans: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    scan = [] if arguments[0].endswith(".ply") else [scans / "sequence"]
    message = refused("render", *scan, *SMALL, "-o", "p.png", *arguments)
    assert all(word in message for word in words), message
    assert names(tmp_path) == []


def test_missing_and_unknown_commands(refused: Callable[..., str], run: Run, scans: Path) -> None:
    message = refused("rendre", "x")
    assert all(name in message for name in ("'rendre'. Did you mean 'render'?", *command_names()))
    assert "'scan4d --help'" in refused("--bogus")
    assert "Write it after 'info'" in refused("-q", "info", scans / "ball.npz")
    assert "-o" in refused("render", scans / "ball.npz")
    assert "'--outptu'. Did you mean '--output'" in refused("render", "demo", "--outptu", "x.png")
    for words in (["--set", "a=1", scans / "ball.npz"], [scans / "ball.npz"]):
        message = refused(*words)
        assert f"a command is missing. 'scan4d view {scans / 'ball.npz'}' shows it" in message
        assert all(name in message for name in command_names())
    assert "a command is missing before '--set'" in refused("--set", "a=1", "nowhere.ply")
    for command in ("doctor", "backends"):
        message = refused(command, "extra")
        assert f"'extra': too much, as 'scan4d {command}' takes options alone" in message
        assert "quote" not in message
    assert "'c': too much, as 'scan4d convert' takes SCAN OUT" in refused("convert", "a", "b", "c")
    assert "the name after 'scan4d info' is empty" in refused("info", "")
    assert "SCAN" in refused("info")
    done = run()
    assert (done.code, done.err) == (0, "")
    assert all(f"\n    {name} " in done.out for name in command_names())


def test_an_unexpected_error_is_one_message(
    run: Run, scans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError("by nought")

    monkeypatch.setattr(drawing, "shots", fail)
    ball = ["render", str(scans / "ball.npz"), "-o", str(tmp_path / "a.png")]
    done = run(*ball)
    assert done.code == 1
    assert done.err == "scan4d: internal error (ZeroDivisionError: by nought). Run it again with --debug\n"
    assert cli.main([*ball, "--debug"]) == 1
    err = capsys.readouterr().err
    assert err.startswith("Traceback")
    assert err.endswith(done.err)


def test_errors_that_follow_an_interrupt_are_the_interrupt(
    run: Run, scans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt:
            raise ImportError("it failed to import") from None

    monkeypatch.setattr(drawing, "shots", fail)
    done = run("render", scans / "ball.npz", "-o", tmp_path / "a.png")
    assert done == (1, "", "scan4d: stopped\n")


def test_debug_shows_the_traceback_of_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["info", "nowhere.ply", "--debug"]) == 2
    assert capsys.readouterr().err.startswith("Traceback")


@pytest.mark.parametrize("debug", [False, True])
def test_debug_shows_what_fails_in_the_window(
    debug: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from viewer import app

    def fail(*_: object, **__: object) -> int:
        log = logging.getLogger("viewer.app.failures")
        try:
            raise ZeroDivisionError("by \x1bnought")
        except ZeroDivisionError as error:
            log.error("%s failed", "A frame", exc_info=error)
        log.debug("all else")
        return 0

    monkeypatch.setattr(app, "run", fail)
    monkeypatch.setenv("DISPLAY", ":7")
    before = list(logging.getLogger("viewer").handlers)
    assert cli.main(["view", "demo", *(["--debug"] if debug else [])]) == 0
    err = capsys.readouterr().err
    if debug:
        assert err.startswith("scan4d: A frame failed\nTraceback")
        assert err.endswith("ZeroDivisionError: by \\x1bnought\n")
    else:
        assert err == ""
    assert logging.getLogger("viewer").handlers == before


def test_no_opengl_is_code_3(run: Run, scans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> Renderer:
        raise NoOpenGLError("no usable OpenGL", hint="Install a driver")

    monkeypatch.setattr(frame, "shared_renderer", none)
    done = run("render", scans / "ball.npz", "-o", tmp_path / "a.png")
    assert done == (3, "", "scan4d: no usable OpenGL. Install a driver\n")
    listed = json.loads(run("backends", "--json").out)
    assert {b["name"]: b["available"] for b in listed} == dict.fromkeys(backends(), False)
    assert all("no usable OpenGL" in b["why_not"] for b in listed)
    assert "no usable OpenGL" in run("backends").out
    assert run("info", scans / "ball.npz").code == 0


def test_the_device_is_passed_on(scans: Path, tmp_path: Path) -> None:
    ball = ("render", scans / "ball.npz", "-o", tmp_path / "a.png", *SMALL, "--force")
    assert finish(process(*ball, "--device", 0)).code == 0
    done = finish(process(*ball, "--device", 99))
    assert done.code == 3
    assert "99" in done.err


def test_an_interrupt_leaves_nothing(tmp_path: Path) -> None:
    running = process("render", "demo", "-o", tmp_path / "a.mp4", "--all", "--turntable", 9)
    deadline = time.monotonic() + 60
    while not names(tmp_path) and running.poll() is None and time.monotonic() < deadline:
        time.sleep(0.02)
    assert [name[0] for name in names(tmp_path)] == ["."], "it writes under another name first"
    running.send_signal(signal.SIGINT)
    done = finish(running)
    assert (done.code, done.err.splitlines()[-1]) == (1, "scan4d: stopped")
    assert names(tmp_path) == []


def test_a_reader_that_goes_away_is_no_error(scans: Path) -> None:
    running = process("info", scans / "ball.npz")
    assert running.stdout is not None
    running.stdout.close()
    assert running.stderr is not None
    assert running.stderr.read() == ""
    assert running.wait() == 1
    running.stderr.close()


IMPORTED_NEXT = """
import os, signal, sys
class Finder:
    def find_spec(self, name, path, target=None):
        if name == {name!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
from viewer.cli import main
sys.argv[1:] = {argv!r}
sys.exit(main())
"""


@pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")
@pytest.mark.parametrize(
    "name",
    [
        "viewer.commands._line",
        "argparse",
        "numpy",
        "numpy._core._multiarray_umath",
        "moderngl",
        "PIL",
        "cmap",
    ],
)
def test_an_interrupt_while_libraries_are_imported_is_quiet(name: str, scans: Path, tmp_path: Path) -> None:
    argv = [
        "render",
        str(scans / "ball.npz"),
        "-o",
        str(tmp_path / "a.png"),
        *SMALL,
        "--look",
        "color_by=height",
    ]
    code = IMPORTED_NEXT.format(name=name, argv=argv)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert (done.returncode, done.stderr) in ((-signal.SIGINT, ""), (1, "scan4d: stopped\n"))
    assert names(tmp_path) == []


@pytest.mark.skipif(sys.platform == "win32", reason="has no /dev/full")
@pytest.mark.parametrize("where", [">&-", "> /dev/full"])
@pytest.mark.parametrize(
    "words", ["info demo", "backends --json", "--help", "render demo -o {}/a.png --size 9x9"]
)
def test_output_that_cannot_be_written_is_told(where: str, words: str, tmp_path: Path) -> None:
    line = f"{sys.executable} -m viewer.cli {words.format(tmp_path)} {where}"
    done = subprocess.run(line, shell=True, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 1
    why = "it is closed" if where == ">&-" else "the disk is full. Make room, or use another disk"
    assert done.stderr == f"scan4d: standard output: cannot be written: {why}\n"


@pytest.mark.skipif(sys.platform != "linux", reason="names are text elsewhere")
@pytest.mark.parametrize("in_terminal", [False, True])
def test_what_was_written_is_named_byte_by_byte_for_programs(in_terminal: bool, tmp_path: Path) -> None:
    name = b"a\xff\x1b\n\xe2\x82\xac.ply"
    shown = b"a\\udcff\\x1b\\n\xe2\x82\xac.ply" if in_terminal else name
    path = tmp_path / os.fsdecode(name)
    words = [sys.executable, "-m", "viewer.cli", "convert", "demo", "--pose", "0", path]
    environment = {**os.environ, "PYTHONIOENCODING": "utf-8"}
    keyboard, terminal = os.openpty()
    done = subprocess.run(
        words, stdout=terminal if in_terminal else subprocess.PIPE, cwd=ROOT, env=environment, check=True
    )
    os.close(terminal)
    out = os.read(keyboard, 1000).replace(b"\r\n", b"\n") if in_terminal else done.stdout
    os.close(keyboard)
    assert out == os.fsencode(tmp_path) + b"/" + shown + b"\n"
    assert path.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="has no /dev/full")
@pytest.mark.parametrize("where", ["2>&-", "2> /dev/full", "<&- 2>&-"])
def test_messages_that_nobody_can_read_are_lost(where: str, scans: Path, tmp_path: Path) -> None:
    line = (
        f"{sys.executable} -m viewer.cli render {scans}/broken --all -o {tmp_path}/p%d.png --size 9x9 {where}"
    )
    done = subprocess.run(line, shell=True, capture_output=True, text=True, cwd=ROOT)
    assert (done.returncode, done.stdout) == (0, f"{tmp_path}/p%d.png\n")
    assert (
        subprocess.run(f"{sys.executable} -m viewer.cli info no.ply {where}", shell=True, cwd=ROOT).returncode
        == 2
    )


def test_what_a_terminal_cannot_show_is_escaped() -> None:
    done = finish(process("render", "--help", PYTHONIOENCODING="ascii"))
    assert (done.code, done.err) == (0, "")
    assert r"--up \xb1x|\xb1y|\xb1z" in done.out


def test_control_characters_of_files_do_nothing(run: Run, tmp_path: Path) -> None:
    name = "\x1b[31mred\x1b]0;p\x07"
    rows = "property float x\nproperty float y\nproperty float z\n"
    header = f"ply\nformat ascii 1.0\nelement vertex 2\n{rows}property float {name}\nend_header\n"
    (tmp_path / "a\x1b[2J.ply").write_text(header + "1 2 3 4\nnan 2 3 4\n")
    done = run("info", tmp_path / "a\x1b[2J.ply")
    assert done.code == 0
    assert r"\x1b[31mred\x1b]0;p\x07  float32" in done.out
    assert r"a\x1b[2J.ply" in done.err, "it warns of the point that is dropped"
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f-\x9f]", done.out + done.err)
    assert json.loads(run("info", tmp_path / "a\x1b[2J.ply", "--json").out)["attributes"].keys() == {name}


def test_quiet_says_nothing_but_errors(run: Run, scans: Path, tmp_path: Path) -> None:
    assert run("render", scans / "broken", "-o", tmp_path / "p%d.png", *SMALL, "--all", "-q") == (0, "", "")
    assert run("convert", scans / "broken", tmp_path / "p%d.ply", "--quiet") == (0, "", "")
    assert run("info", scans / "nowhere", "-q").err.startswith("scan4d: ")
    assert "points" in run("info", scans / "ball.npz", "-q").out


def test_the_version(run: Run) -> None:
    assert run("--version") == (0, f"scan4d {viewer.__version__}\n", "")


# --- info, convert, backends, doctor ----------------------------------------------------------


def test_info_as_json(run: Run, scans: Path) -> None:
    done = run("info", scans / "sequence", "--json", "--unit", "mm", "--fps", 10)
    assert (done.code, done.err) == (0, "")
    facts = json.loads(done.out)
    cloud = formats.read(scans / "sequence" / "f00.npz")
    world = cloud.world()
    assert facts["name"] == "sequence"
    assert (facts["poses"], facts["unit"], facts["pose"], facts["label"]) == (5, "mm", 0, "f00.npz")
    assert facts["times"] == {"first": 0, "last": 0.4, "median_step": pytest.approx(0.1)}
    assert (facts["points"], facts["dropped"]) == (2000, 0)
    assert np.allclose(facts["bounds"]["low"], world.min(axis=0))
    assert np.allclose(facts["bounds"]["high"], world.max(axis=0))
    assert facts["origin"] == cloud.origin.tolist()
    assert list(facts["attributes"]) == ["normals", "colors", "radii", "height"]
    assert facts["attributes"]["colors"] == {
        "type": "uint8", "columns": 4, "range": [cloud.colors.min(), 255],
    }  # fmt: skip
    assert facts["attributes"]["height"]["range"] == [
        pytest.approx(cloud.scalars["height"].min()), pytest.approx(cloud.scalars["height"].max()),
    ]  # fmt: skip


def test_info_as_text(run: Run, scans: Path) -> None:
    done = run("info", scans / "sequence", "--unit", "mm")
    lines = dict(re.split(" {2,}", line, maxsplit=1) for line in done.out.splitlines())
    assert lines["poses"] == "5, 0 to 0.16 s, 25 a second"
    assert lines["points"] == "2,000"
    assert lines["unit"] == "mm"
    assert lines["colors"].startswith("uint8 x 4")


def test_info_reads_the_first_readable_pose_alone(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for index in range(4):
        formats.write(tmp_path / f"f{index}.npz", cloud_at(index))
    (tmp_path / "f0.npz").write_bytes(b"nothing")
    read: list[str] = []
    original = formats.read

    def noted(path: Path, *rest: int) -> PointCloud:
        read.append(path.name)
        return original(path, *rest)

    monkeypatch.setattr(formats, "read", noted)
    done = run("info", tmp_path, "--json")
    assert json.loads(done.out)["pose"] == 1
    assert "f0.npz" in done.err
    assert read == ["f1.npz"]


def test_info_copes_with_values_that_are_not_finite(run: Run, tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", positions=np.eye(3), some=[1, np.nan, 2.5], none=np.full(3, np.inf))
    attributes = json.loads(run("info", tmp_path / "a.npz", "--json").out)["attributes"]
    assert attributes["some"]["range"] == [1, 2.5]
    assert attributes["none"]["range"] is None
    assert "no finite value" in run("info", tmp_path / "a.npz").out


@pytest.mark.parametrize("suffix", formats.writable_suffixes())
def test_convert_keeps_everything(suffix: str, run: Run, scans: Path, tmp_path: Path) -> None:
    out = tmp_path / f"a{suffix}"
    assert run("convert", scans / "ball.npz", out) == (0, f"{out}\n", "")
    assert names(tmp_path) == [out.name]
    before, after = formats.read(scans / "ball.npz"), formats.read(out)
    assert np.array_equal(before.world(), after.world())
    for name in ("normals", "colors", "radii"):
        assert np.array_equal(getattr(before, name), getattr(after, name)), name
    assert np.array_equal(before.scalars["height"], after.scalars["height"])


@pytest.mark.parametrize(
    ("choice", "indices"),
    [([], [0, 1, 2, 3, 4]), (["--all"], [0, 1, 2, 3, 4]), (["--poses", "1:5:2"], [1, 3])],
)
def test_convert_of_a_sequence_keeps_its_times(
    choice: list[str], indices: Sequence[int], run: Run, scans: Path, tmp_path: Path
) -> None:
    done = run("convert", scans / "sequence", tmp_path / "out%03d.ply", "--fps", 12, *choice)
    assert done.code == 0
    assert names(tmp_path) == [*(f"out{index:03d}.ply" for index in indices), "times.csv"]
    with open_scan(tmp_path) as timeline:
        assert np.array_equal(timeline.times, np.array(indices) / 12)
        for place, index in enumerate(indices):
            assert np.array_equal(timeline.pose(place).cloud.positions, cloud_at(index).positions)
    again = run("convert", scans / "sequence", tmp_path / "out%03d.ply", "--fps", 12, "--force", *choice)
    assert again.code == 0


def test_convert_of_one_pose_of_several(
    run: Run, refused: Callable[..., str], scans: Path, tmp_path: Path
) -> None:
    assert run("convert", scans / "sequence", tmp_path / "a.pcd", "--pose", 2).code == 0
    assert np.array_equal(formats.read(tmp_path / "a.pcd").world(), cloud_at(2).world())
    assert run("convert", scans / "sequence", tmp_path / "b.pcd", "--time", 0.08).code == 0
    assert (tmp_path / "a.pcd").read_bytes() == (tmp_path / "b.pcd").read_bytes()
    message = refused("convert", scans / "sequence", tmp_path / "c.pcd")
    assert "c%04d.pcd" in message
    assert ".mp4" not in message
    assert names(tmp_path) == ["a.pcd", "b.pcd"]


def test_convert_leaves_broken_frames_out(run: Run, scans: Path, tmp_path: Path) -> None:
    done = run("convert", scans / "broken", tmp_path / "f%d.npz")
    assert done.code == 0
    assert "f02.npz" in done.err
    assert names(tmp_path) == ["f0.npz", "f1.npz", "f3.npz", "f4.npz", "times.csv"]
    with open_scan(tmp_path) as timeline:
        assert np.allclose(timeline.times, [0, 0.04, 0.12, 0.16])


def test_convert_spares_the_times_of_other_files(
    refused: Callable[..., str], scans: Path, tmp_path: Path
) -> None:
    (tmp_path / "times.csv").write_text("mine.ply,0\nmine2.ply,1\n")
    message = refused("convert", scans / "sequence", tmp_path / "f%d.ply")
    assert "times.csv" in message
    assert names(tmp_path) == ["times.csv"]


def test_convert_refuses_what_it_cannot_write(
    refused: Callable[..., str], scans: Path, tmp_path: Path
) -> None:
    message = refused("convert", scans / "ball.npz", tmp_path / "a.obj")
    assert all(suffix in message for suffix in formats.writable_suffixes())
    assert "Create it" in refused("convert", scans / "ball.npz", tmp_path / "missing" / "a.ply")


def test_backends_as_json(run: Run) -> None:
    listed = json.loads(run("backends", "--json").out)
    assert [b["name"] for b in listed] == list(backends())
    for facts, backend in zip(listed, backends().values(), strict=True):
        assert (facts["title"], facts["help"]) == (backend.title, backend.help)
        assert (facts["available"], facts["why_not"]) == (True, None)
        assert [p["name"] for p in facts["parameters"]] == [p.name for p in backend.parameters]
        for parameter in facts["parameters"]:
            assert parameter.keys() >= {"type", "default", "range", "choices", "sweep", "affects", "help"}
    by_name = {b["name"]: b for b in listed}
    assert by_name["points"]["needs"] == []
    assert by_name["surfels"]["needs"] == ["normals"]
    assert by_name["points"]["parameters"][0]["range"] == [0, 32]


def test_backends_as_text(run: Run) -> None:
    out = run("backends").out
    for backend in backends().values():
        assert f"{backend.name}: {backend.help}" in out
        for parameter in backend.parameters:
            assert re.search(rf"^  {parameter.name} .*{re.escape(parameter.help)}$", out, re.M)


def test_doctor(renderer: Renderer) -> None:
    done = finish(process("doctor", DISPLAY="", WAYLAND_DISPLAY=""))
    assert done.code == 0
    for words in (
        renderer.gpu.device, renderer.gpu.driver, "GL_ARB_clip_control", "max_shader_storage_block_size",
        f"Python   {sys.version.split()[0]}", viewer.__version__, "neither DISPLAY nor WAYLAND_DISPLAY",
        "not open a window",
    ):  # fmt: skip
        assert words in re.sub("  +", "   ", done.out), words
    done = finish(process("doctor", DISPLAY=":7", WAYLAND_DISPLAY=""))
    assert "DISPLAY=:7" in done.out


def test_doctor_without_opengl() -> None:
    done = finish(process("doctor", "--device", 99))
    assert (done.code, done.err) == (3, "")
    assert "EGL device 99" in done.out
    assert "lists the devices" in done.out


@pytest.mark.usefixtures("mesa")
def test_an_older_opengl_is_named(tmp_path: Path) -> None:
    older = {"MESA_GL_VERSION_OVERRIDE": "3.3", "DISPLAY": "", "WAYLAND_DISPLAY": ""}
    done = finish(process("render", "demo", "-o", tmp_path / "a.png", **older))
    assert done.code == 3
    assert re.fullmatch(r"scan4d: OpenGL 3\.3 on [^\n]* is not enough\. [^\n]* 4\.3 [^\n]*\n", done.err), (
        done.err
    )
    done = finish(process("doctor", **older))
    assert done.code == 3
    assert "OpenGL 3.3 on " in done.out


@pytest.fixture
def mesa(renderer: Renderer) -> None:
    if "Mesa" not in renderer.gpu.driver:
        pytest.skip("these environment variables are Mesa's")


@pytest.fixture
def full_disk(tmp_path: Path) -> Iterator[Path]:
    """The folder of a file system of its own that has no room."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(folder)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("a file system cannot be mounted here")
    try:
        (folder / "full").write_bytes(bytes(60_000))
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.usefixtures("mesa")
def test_a_full_disk_under_the_shader_cache_is_no_harm(full_disk: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    caches = {
        str(full_disk): "the disk is full",
        str(tmp_path / "file"): "a part of its path is no folder",
        str(tmp_path / "new"): str(tmp_path / "new" / "mesa_shader_cache") + "\n",
    }
    for cache, words in caches.items():
        done = finish(process("doctor", MESA_SHADER_CACHE_DIR=cache))
        assert (done.code, done.err) == (0, "")
        assert re.search(rf"shader cache +.*{re.escape(words)}", done.out), done.out
    picture = ("render", "demo", "-o", tmp_path / "a.png", *SMALL)
    done = finish(process(*picture, MESA_SHADER_CACHE_DIR=str(full_disk)))
    assert done == (0, f"{tmp_path / 'a.png'}\n", "")


# --- view -----------------------------------------------------------------------------------


@pytest.fixture
def no_display(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)


@pytest.mark.usefixtures("no_display")
def test_view_without_a_display_is_code_3(run: Run, scans: Path) -> None:
    done = run("view", scans / "ball.npz")
    assert (done.code, done.out) == (3, "")
    assert re.fullmatch("scan4d: [^\n]*DISPLAY[^\n]*--fallback[^\n]*\n", done.err)


@pytest.mark.usefixtures("no_display")
def test_view_falls_back_to_pictures(run: Run, scans: Path, tmp_path: Path) -> None:
    out = tmp_path / "new" / "out"
    done = run("view", scans / "broken", "--fallback", out)
    assert done.code == 0
    assert "f02.npz" in done.err
    assert names(out) == [
        "broken.mp4", "broken_0000.png", "broken_0001.png", "broken_0003.png", "broken_0004.png",
        "broken_contact_sheet.png",
    ]  # fmt: skip
    assert "No window" in done.out
    assert all(str(out / f"broken{name}") in done.out for name in ("_%04d.png", "_contact_sheet.png", ".mp4"))
    frames, rate = film(out / "broken.mp4")
    assert (len(frames), rate) == (4, 25)
    shown = picture(out / "broken_0003.png")
    assert shown.shape == (800, 1200, 4)
    assert np.median(np.abs(frames[2].astype(int) - shown[..., :3])) <= 2
    sheet = picture(out / "broken_contact_sheet.png")
    assert sheet.shape[1] > 2 * 320


@pytest.mark.usefixtures("no_display")
def test_view_leaves_out_what_is_missing_among_several(run: Run, scans: Path, tmp_path: Path) -> None:
    done = run("view", scans / "ball.npz", scans / "gone.npz", "--fallback", tmp_path)
    assert done.code == 0
    assert done.err.count("gone.npz: no such file") == 1
    assert list(tmp_path.glob("*.mp4"))


def test_the_fallback_keeps_several_scans_apart(run: Run, scans: Path, tmp_path: Path) -> None:
    assert run("view", scans / "ball.npz", scans / "ball.npz", "--fallback", tmp_path).code == 0
    assert [name for name in names(tmp_path) if name.endswith("mp4")] == ["0_ball_npz.mp4", "1_ball_npz.mp4"]


@pytest.mark.usefixtures("no_display")
def test_a_fallback_that_cannot_be_a_folder(refused: Callable[..., str], run: Run, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    done = run("view", "--fallback", tmp_path / "file")
    assert done.code == 2
    assert str(tmp_path / "file") in done.err


def test_view_passes_everything_to_the_window(run: Run, scans: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from viewer import app

    calls: list[tuple[object, dict[str, object]]] = []
    monkeypatch.setattr(app, "run", lambda scans, **options: calls.append((scans, options)) or 0)
    monkeypatch.setenv("DISPLAY", ":7")
    ball = str(scans / "ball.npz")
    assert run("view", ball, "demo", "--unit", "mm", "--fps", 12, "--up", "-z", "--device", 1).code == 0
    assert run("view").code == 0
    assert calls == [
        ([ball, "demo"], {"unit": "mm", "fps": 12, "up": "-z", "device": 1, "replay": None}),
        (["demo"], {"unit": None, "fps": None, "up": "+y", "device": None, "replay": None}),
    ]


def test_a_window_that_does_not_open_falls_back(
    run: Run, scans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from viewer import app

    def fail(*_: object, **__: object) -> int:
        raise NoOpenGLError("the window did not open", hint="Try another display")

    monkeypatch.setattr(app, "run", fail)
    monkeypatch.setenv("DISPLAY", ":7")
    assert run("view", scans / "ball.npz").code == 3
    done = run("view", scans / "ball.npz", "--fallback", tmp_path)
    assert done.code == 0
    assert "the window did not open" in done.out
    assert "ball_npz.mp4" in names(tmp_path)


# --- progress, help -------------------------------------------------------------------------


def test_progress_is_for_terminals_alone(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from viewer.commands import _console as console

    def play() -> str:
        with console.progress(3) as tick:
            for _ in range(3):
                time.sleep(0.6)
                tick()
            console.warn("a word")
        return capsys.readouterr().err

    monkeypatch.delitem(sys.modules, "tqdm", raising=False)
    assert play() == "scan4d: a word\n"
    assert "tqdm" not in sys.modules
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    shown = play()
    assert "3/3" in shown
    assert "\nscan4d: a word\n" in shown.replace("\r", "\n")


@pytest.mark.parametrize("command", command_names())
def test_help(command: str, run: Run) -> None:
    done = run(command, "--help")
    assert (done.code, done.err) == (0, "")
    for flag in ("--device N", "--unit U", "--fps F", "--up ±x|±y|±z", "-q, --quiet", "--debug"):
        assert flag in done.out


def test_the_docs_name_every_flag_and_no_other(run: Run) -> None:
    page = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8")
    sections = dict(re.findall(r"^## `scan4d (\w+).*?`\n(.*?)(?=^## |\Z)", page, re.M | re.S))
    common = {"--device", "--unit", "--fps", "--up", "--quiet", "--debug"}
    assert sorted(sections) == list(command_names())
    for command in command_names():
        flags = set(re.findall(r"(?<![\w-])--[a-z]+", run(command, "--help").out)) - common - {"--help"}
        assert set(re.findall(r"`(--[a-z]+)", sections[command])) - common == flags - {"--output"}, command
    assert common <= set(re.findall(r"`(--[a-z]+)", page.split("\n## ")[0]))


def test_info_and_convert_import_no_gl(scans: Path) -> None:
    code = (
        "import sys; from viewer.cli import main; main(sys.argv[1:]); "
        "print(*{name.partition('.')[0] for name in sys.modules} & {'moderngl', 'OpenGL', 'PIL', 'tqdm'})"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "info", str(scans / "ball.npz")],
        capture_output=True, text=True, cwd=ROOT, check=True,
    )  # fmt: skip
    assert done.stdout.splitlines()[-1] == ""
