"""`scan4d render`: pictures, films, turntables, broken frames, statistics."""

from __future__ import annotations

import itertools
import json
import re
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from depth_folders import write_color, write_depth, write_matrix
from small_scans import FRAMES, SMALL, front, names, stored
from written import bits, film, film_times, picture

import viewer
from viewer.app.scene.extent import Extent
from viewer.camera import Camera
from viewer.document.recording import Recording
from viewer.drawing import frame
from viewer.drawing.renderer import Renderer
from viewer.look import SAMPLES, Look
from viewer.picture.surface import NOTHING
from viewer.scan import formats
from viewer.scan.open import open_scan
from viewer.scan.pods import first_camera
from viewer.scan.points import PointCloud


def test_a_picture_is_what_the_library_draws(run: Run, scans: Path, tmp_path: Path) -> None:
    done = run("render", scans / "ball.npz", "-o", tmp_path / "a.png", *SMALL)
    assert done == (0, f"{tmp_path / 'a.png'}\n", "")
    cloud = formats.read(scans / "ball.npz")
    surface = viewer.render(cloud, front(cloud), (96, 64), "surfels")
    assert np.array_equal(picture(tmp_path / "a.png"), surface.image())
    assert names(tmp_path) == ["a.png"]


@pytest.mark.slow
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
    ("argument", "orbit"),
    [("30,15", (30, 15)), ("-30,15", (-30, 15)), ("-.5,-20,7.5", (-0.5, -20, 7.5))],
)
@pytest.mark.parametrize("up", ["+y", "-z"])
def test_orbit_and_up(
    argument: str, orbit: tuple[float, ...], up: str, run: Run, scans: Path, tmp_path: Path
) -> None:
    ball = ("render", scans / "ball.npz", "-o", tmp_path / "a.png", *SMALL)
    assert run(*ball, "--up", up, "--orbit", argument).code == 0
    cloud = formats.read(scans / "ball.npz")
    camera = front(cloud, up=up, **dict(zip(("azimuth", "elevation", "distance"), orbit, strict=False)))
    expected = viewer.render(cloud, camera, (96, 64), "surfels").image()
    assert np.array_equal(picture(tmp_path / "a.png"), expected)
    assert run(*ball, f"--up={up}", f"--orbit={argument}", "--force").code == 0
    assert np.array_equal(picture(tmp_path / "a.png"), expected)


def test_range_views_tell_what_is_up(run: Run, tmp_path: Path) -> None:
    """As the poses of 7-Scenes do: the world is the first camera's space, where y goes down."""
    folder = tmp_path / "scene"
    write_depth(folder / "frame-000000.depth.png", np.full((30, 40), 1500, np.uint16))
    colors = np.zeros((30, 40, 3), np.uint8)
    colors[:15, :, 0] = colors[15:, :, 2] = 255
    write_color(folder / "frame-000000.color.png", colors)
    write_matrix(folder / "frame-000000.pose.txt", np.eye(4))
    draw = ("render", folder, *SMALL, "--force", "-o", tmp_path / "a.png")
    shown = {}
    for up in ("", "-y", "+y"):
        assert run(*draw, *(["--up", up] if up else [])).code == 0
        shown[up] = picture(tmp_path / "a.png")
    assert np.array_equal(shown[""], shown["-y"])
    assert not np.array_equal(shown[""], shown["+y"])
    assert run("render", folder, *SMALL, "--look", "up=+z", "--force", "-o", tmp_path / "a.png").code == 0
    assert np.array_equal(picture(tmp_path / "a.png"), shown[""])  # --look is of colours by height alone


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


@pytest.fixture
def gap(scans: Path, tmp_path: Path) -> Path:
    """A folder of frames 1, 2 and 6, at 0, 0.04 and 0.2 s."""
    folder = tmp_path / "gap"
    folder.mkdir()
    for number in (1, 2, 6):
        shutil.copy(scans / "sequence" / f"f{min(number, FRAMES) - 1:02d}.npz", folder / f"f{number:03d}.npz")
    return folder


@pytest.mark.parametrize("more", [(), ("--no-gl",), ("--turntable", 4)])
def test_a_film_shows_each_pose_until_the_next(
    more: tuple[object, ...], gap: Path, run: Run, tmp_path: Path
) -> None:
    assert run("render", gap, "--all", "-o", tmp_path / "a.mp4", *SMALL[:2], *more).code == 0
    stamps, length = film_times(tmp_path / "a.mp4")
    assert [*stamps, length] == pytest.approx([0, 0.04, 0.2, 0.36], abs=1e-4)


def test_an_even_film_repeats_a_pose_over_a_gap(gap: Path, run: Run, tmp_path: Path) -> None:
    (gap / "times.csv").write_text("f001.npz,5\nf002.npz,5.04\nf006.npz,5.2\n")
    even = (*SMALL, "--fps", 10, "--stats", tmp_path / "s.json")
    assert run("render", gap, "--all", "-o", tmp_path / "a.mp4", *even).code == 0
    assert film_times(tmp_path / "a.mp4")[0] == pytest.approx([0, 0.1, 0.2, 0.3], abs=1e-4)
    frames, _ = film(tmp_path / "a.mp4")
    same = [np.abs(a.astype(int) - b).max() < 8 for a, b in itertools.pairwise(frames)]
    assert same == [False, False, True]
    drawn = json.loads((tmp_path / "s.json").read_text())["frames"]
    assert [row["pose"] for row in drawn] == [0, 1, 2], "each is drawn once"


def test_a_film_at_a_rate_that_no_player_shows_is_refused(scans: Path, run: Run, tmp_path: Path) -> None:
    done = run("render", scans / "sequence", "--all", "-o", tmp_path / "a.mp4", "--fps", 1000)
    assert done.code == 2
    assert "1 to 240" in done.err
    assert names(tmp_path) == []


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


def test_the_first_camera_is_that_of_the_window(run: Run, data_dir: Path, tmp_path: Path) -> None:
    with open_scan(data_dir / "sequences" / "crane_175") as timeline:
        for number, away in enumerate([0, 0, 0, 1e4, 0]):  # one frame is astray
            positions = timeline.pose(40 * number).cloud.positions
            np.savez(tmp_path / f"f{number}.npz", positions=positions + np.float32(away))
    with open_scan(tmp_path) as timeline:
        extent = Extent()
        extent.begin(timeline)
        pose = timeline.pose(0)
        extent.visit()
        while not extent.take_visited():
            time.sleep(0.01)
        assert pose.upright.front == -90
        expected = first_camera((), extent.around(pose.bounds), 96 / 64, pose.upright)
    out = tmp_path / "out"
    out.mkdir()
    assert run("render", tmp_path, "--all", *SMALL, "-o", out / "p%d.png").code == 0
    drawn = Recording.load(out / "p0.png").entries[0].camera
    assert drawn == expected
    assert run("render", tmp_path, "--all", "--turntable", 4, *SMALL, "-o", out / "t%d.png").code == 0
    turned = Recording.load(out / "t0.png").entries[0].camera
    assert turned.rotation() == pytest.approx(expected.rotation()), "it begins at the front"


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


def test_a_broken_frame_is_reported_and_the_rest_is_drawn(run: Run, scans: Path, tmp_path: Path) -> None:
    done = run("render", scans / "broken", "-o", tmp_path / "p%d.png", *SMALL, "--all")
    assert done.code == 0
    assert names(tmp_path) == ["p0.png", "p1.png", "p3.png", "p4.png"]
    assert re.fullmatch(r"scan4d: broken: Scan4D leaves out frame 3: [^\n]*f02\.npz[^\n]*\n", done.err), (
        done.err
    )


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
    assert done.err.splitlines()[-1].endswith("none of the 3 frames can be read")
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


@pytest.mark.parametrize("repeat", [None, 3])
def test_stats(repeat: int | None, renderer: Renderer, run: Run, scans: Path, tmp_path: Path) -> None:
    again = [] if repeat is None else ["--repeat", repeat]
    points = ("--backend", "points", "--set", "point_size=2")
    sequence = ("render", scans / "sequence", "--poses", "1:3", *SMALL, *points)
    done = run(*sequence, "-o", tmp_path / "p%d.npz", "--stats", tmp_path / "stats.json", *again)
    assert done.code == 0
    stats = json.loads((tmp_path / "stats.json").read_text())
    assert list(stats) == [
        "device", "timer", "backend", "params", "automatic", "size", "drawn_size", "frames", "bytes_gpu",
        "peak_rss",
    ]  # fmt: skip
    assert stats["device"] == renderer.gpu.device
    assert stats["timer"] in ("query", "finish")
    assert (stats["backend"], stats["params"], stats["size"]) == (
        "points",
        {"point_size": 2, "hide_hidden": False, "share": 1.0},
        [96, 64],
    )
    assert (stats["automatic"], stats["drawn_size"]) == (None, [96, 64])
    assert stats["bytes_gpu"] > 2000 * 12
    assert stats["peak_rss"] > 10e6
    assert [f["pose"] for f in stats["frames"]] == [1, 2]
    for f in stats["frames"]:
        assert list(f) == [
            "pose", "gpu_ms", "cpu_ms", "upload_ms", "uploaded_bytes", "shared", "derive_ms", "passes",
            "points", "skipped", "counted", "chosen",
        ]  # fmt: skip
        assert f["upload_ms"] > 0
        assert f["uploaded_bytes"] >= 2000 * 12
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
    from viewer.drawing import timing

    drawn: list[bool] = []
    draw = timing.draw

    def counted(renderer: Renderer, *rest: object) -> object:
        drawn.append(renderer.gpu.timers.enabled)
        return draw(renderer, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(timing, "draw", counted)
    ball = ("render", scans / "ball.npz", "-o", tmp_path / "a.png", *SMALL, "--stats", tmp_path / "s.json")
    assert run(*ball, "--repeat", 4).code == 0
    assert drawn == [False] * (2 + 4) + [True] * 4


def test_one_colour_is_one_value_in_all_frames(run: Run, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    positions = rng.uniform(-1, 1, (4000, 3)) * [1, 1, 0]
    for index in range(3):
        values = np.full(4000, index, np.float32)
        values[:400] = 0.5  # the same in all
        (tmp_path / "scan").mkdir(exist_ok=True)
        cloud = PointCloud.from_arrays(positions, scalars={"shift": values})
        formats.write(tmp_path / "scan" / f"{index}.npz", cloud)
    arguments = [
        "render",
        tmp_path / "scan",
        *SMALL,
        "--backend",
        "points",
        "--look",
        "color_by=shift",
        "light=flat",
    ]
    assert run(*arguments, "--all", "-o", tmp_path / "all%d.png").code == 0
    looks = [Recording.load(tmp_path / f"all{index}.png").entries[0].look for index in range(3)]
    assert {(look.low, look.high) for look in looks} == {(0, 2)}
    assert run("render", "--replay", tmp_path / "all1.png", "-o", tmp_path / "again.png").code == 0
    assert np.array_equal(picture(tmp_path / "again.png"), picture(tmp_path / "all1.png"))

    assert run(*arguments, "--pose", "1", "-o", tmp_path / "one.png").code == 0
    assert Recording.load(tmp_path / "one.png").entries[0].look.range == "frame"
    assert run(*arguments, "range=frame", "--all", "-o", tmp_path / "own%d.png").code == 0
    assert np.array_equal(picture(tmp_path / "own1.png"), picture(tmp_path / "one.png"))
    assert not np.array_equal(picture(tmp_path / "own1.png"), picture(tmp_path / "all1.png"))


def test_quality_smooths_pictures_and_leaves_what_is_measured(run: Run, scans: Path, tmp_path: Path) -> None:
    ball = ("render", scans / "ball.npz", *SMALL)
    for name in SAMPLES:
        for suffix in ("png", "npz"):
            assert run(*ball, "--quality", name, "-o", tmp_path / f"{name}.{suffix}").code == 0
    assert run(*ball, "-o", tmp_path / "usual.png").code == 0
    fast, balanced, fine, usual = (picture(tmp_path / f"{name}.png") for name in (*SAMPLES, "usual"))
    assert (fast != balanced).any()
    assert (balanced != fine).any()
    assert np.array_equal(balanced, usual)
    one, many = (stored(tmp_path / f"{name}.npz") for name in ("fast", "fine"))
    assert all(np.array_equal(bits(one[name]), bits(many[name])) for name in one)
    again = ("render", "--replay", tmp_path / "fast.png", "-o")
    assert run(*again, tmp_path / "again.png").code == 0
    assert np.array_equal(picture(tmp_path / "again.png"), fast)
    assert run(*again, tmp_path / "finer.png", "--quality", "fine").code == 0
    assert np.array_equal(picture(tmp_path / "finer.png"), fine)
