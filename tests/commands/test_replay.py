"""`scan4d render --replay` draws the same pictures, bit for bit."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from hostile_values import variants
from scenes import sphere
from written import bits, film, film_times, picture

from viewer.backends import backend
from viewer.camera import Camera
from viewer.document.recording import Entry, Recording, fingerprint, matrix_of
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.errors import InputError
from viewer.geometry import vector
from viewer.look import Look, rgba
from viewer.output.export import marked, read_description
from viewer.output.legend import Marks
from viewer.output.overlays import LINE_COLOR, DrawnCurve, DrawnLandmark, DrawnPath, DrawnPlot
from viewer.picture.surface import Surface
from viewer.rigid import Rigid
from viewer.scan import formats
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud

SMALL = ("--size", "96x64")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, with the scans ball.npz and sequence/."""
    monkeypatch.chdir(tmp_path)
    formats.write(Path("ball.npz"), sphere(2000))
    Path("sequence").mkdir()
    for index in range(3):
        formats.write(Path("sequence") / f"f{index}.npz", sphere(2000, radius=1 + 0.2 * index))
    return tmp_path


def entry(**changes: object) -> Entry:
    cloud = sphere(2000)
    first = Entry(
        "sequence", None, 0, 0.0, (96, 64), Camera.orbit(cloud.bounds(), 30, 20, aspect=1.5),
        "points", backend("points").params({"point_size": 3}), Look(color_by="height"),
    )  # fmt: skip
    return replace(first, **changes)  # type: ignore[arg-type]


def recorded(path: Path) -> Recording:
    """Three poses, another renderer, another size; for half a second."""
    surfels = {"backend": "surfels", "params": backend("surfels").params()}
    shown = (
        entry(), entry(pose=1, time=0.04, at=0.04), entry(pose=2, time=0.08, at=0.2),
        entry(pose=2, time=0.08, at=0.3, **surfels), entry(pose=2, time=0.08, at=0.4, size=(64, 48)),
    )  # fmt: skip
    recording = Recording(shown, 0.5)
    recording.save(path)
    return recording


CHOICES = [
    ["ball.npz"],
    ["demo", "--pose", 7, "--up", "-y"],
    ["sequence", "--pose", 2, "--orbit", "30,-20", "--look", "color_by=height", "light=flat", "eye_dome=on"],
    ["ball.npz", "--backend", "points", "--set", "point_size=4", "--look", "background=#10203080"],
]


@pytest.mark.parametrize("choice", CHOICES)
@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_a_picture_is_drawn_again_from_itself(suffix: str, choice: list[object], run: Run) -> None:
    assert run("render", *choice, *SMALL, "-o", f"a{suffix}").code == 0
    assert run("render", *choice, *SMALL, "-o", "expected.npz").code == 0
    assert run("render", "--replay", f"a{suffix}", "-o", f"again{suffix}") == (0, f"again{suffix}\n", "")
    assert Path(f"again{suffix}").read_bytes() == Path(f"a{suffix}").read_bytes()
    # And in another format it is the same surface.
    assert run("render", "--replay", f"a{suffix}", "-o", "again.npz").code == 0
    with np.load("expected.npz") as expected, np.load("again.npz") as again:
        assert all(np.array_equal(bits(again[name]), bits(expected[name])) for name in expected)
        assert (expected["level"] == 0).any()


def test_pictures_of_a_turntable_are_drawn_again(run: Run) -> None:
    assert run("render", "sequence", "--pose", 1, "--turntable", 3, *SMALL, "-o", "t%d.png").code == 0
    for number in range(3):
        assert run("render", "--replay", f"t{number}.png", "-o", "again.png", "--force").code == 0
        assert np.array_equal(picture(Path("again.png")), picture(Path(f"t{number}.png")))


def test_a_picture_tells_its_scan_and_the_scans_hash(run: Run) -> None:
    assert run("render", "ball.npz", *SMALL, "-o", "a.png").code == 0
    assert run("render", "sequence", "--pose", 1, *SMALL, "-o", "b.exr").code == 0
    (ball,), (pose,) = Recording.load(Path("a.png")).entries, Recording.load(Path("b.exr")).entries
    assert (ball.scan, ball.hash) == ("ball.npz", fingerprint([Path("ball.npz")]))
    assert (pose.scan, pose.pose, pose.time, pose.size) == ("sequence", 1, 0.04, (96, 64))
    assert pose.hash == fingerprint(sorted(Path("sequence").iterdir()))


@pytest.mark.slow
def test_landmarks_and_their_lines_stand_in_anonymous_pictures_where_they_are(run: Run) -> None:
    away = np.array([5000.0, -300.0, 20.0])
    formats.write(Path("away.npz"), PointCloud.from_arrays(sphere(2000).world() + away))
    camera = Camera.orbit(sphere(2000).bounds(), 0, 0, aspect=1.5).moved(away)
    places = (0.0, 0.8, 1.2), (0.8, 0.0, 1.2), (0.0, -0.8, 1.2)
    top, side, low = (vector(away + place) for place in places)
    turn = Rigid(np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])).in_frame(-away)
    shown = entry(
        scan="away.npz", camera=camera, size=(1200, 800), look=Look(), at=0.0,
        marks=Marks(landmarks=True, trajectories=True, measure_lines=True, plot=True),
        landmarks=(DrawnLandmark(side, "jane", False, 0.1),), held=matrix_of(turn),
        trajectories=(DrawnPath((top, side), (0xFF0000, 0xFF0000)),),
        measure_lines=(
            DrawnPath((top, side), (0x00FF00,), False, "doe", "1 mm"),
            DrawnPath((side, low), (LINE_COLOR,), name="roe", value="1", has_ends=True),
        ),
        plot=DrawnPlot("time [s]", (0.0, 0.04), (DrawnCurve("doe", "mm", 0x0000FF, (None, 1.0)),)),
    )  # fmt: skip
    Recording((shown,)).save(Path("a.json"))
    assert Recording.load(Path("a.json")).entries == (shown,)
    assert run("render", "--replay", "a.json", "-o", "p.png").code == 0
    assert run("render", "--replay", "a.json", "--anonymous", "-o", "q.png").code == 0
    assert not any(word in read_description(Path("q.png")) for word in ("jane", "doe", "roe", "away", "5000"))
    for color in ((255, 210, 31), (255, 0, 0), (0, 255, 0), rgba(f"#{LINE_COLOR:06x}")[:3]):
        named, anonymous = (
            np.abs(picture(Path(name)).astype(int)[..., :3] - color).max(axis=2) < 60
            for name in ("p.png", "q.png")
        )
        assert anonymous.sum() > 5, color
        assert (named & anonymous).sum() > 0.8 * anonymous.sum(), color  # names have lines of their own
    assert run("render", "--replay", "a.json", "--marks", "landmarks", "-o", "r.png").code == 0
    assert not (np.abs(picture(Path("r.png")).astype(int)[..., :3] - (255, 0, 0)).max(axis=2) < 60).any()


def test_every_entry_of_a_recording_is_drawn_at_its_size(run: Run) -> None:
    shown = recorded(Path("a.json")).entries
    assert run("render", "--replay", "a.json", "-o", "p%d.png") == (0, "p%d.png\n", "")
    pictures = [picture(Path(f"p{number}.png")) for number in range(5)]
    assert [p.shape for p in pictures] == [(64, 96, 4)] * 4 + [(48, 64, 4)]
    assert not Path("p5.png").exists()
    for number, wanted in enumerate(shown):
        wanted.camera.save(Path("camera.json"))
        size = f"{wanted.size[0]}x{wanted.size[1]}"
        settings = ["--set", "point_size=3"] if wanted.backend == "points" else []
        done = run(
            "render", "sequence", "--pose", wanted.pose, "--camera", "camera.json", "--size", size,
            "--backend", wanted.backend, *settings, "--look", "color_by=height", "-o", "expected.png",
            "--force",
        )  # fmt: skip
        assert done.code == 0
        assert np.array_equal(pictures[number], picture(Path("expected.png"))), number


def test_a_film_keeps_the_time_stamps(run: Run) -> None:
    recorded(Path("a.json"))
    assert run("render", "--replay", "a.json", "-o", "a.mp4", "--stats", "s.json", "--fps", 20).code == 0
    frames, rate = film(Path("a.mp4"))
    assert (len(frames), rate) == (10, 20)
    assert run("render", "--replay", "a.json", "-o", "p%d.png").code == 0
    shown = [0, 1, 1, 1, 2, 2, 3, 3, 4, 4]
    stills = [picture(Path(f"p{number}.png"))[..., :3].astype(int) for number in range(4)]
    for number, still in zip(shown[:8], frames, strict=False):
        errors = [np.abs(still - other).mean() for other in stills]
        assert int(np.argmin(errors)) == number
    # Each entry is drawn once, however long it is shown; the last one at the size of the film.
    assert [f["pose"] for f in json.loads(Path("s.json").read_text())["frames"]] == [0, 1, 2, 2, 2]
    assert {frame.shape for frame in frames} == {(64, 96, 3)}


def test_a_film_changes_at_the_stamps_of_the_recording(run: Run) -> None:
    recording = recorded(Path("a.json"))
    assert run("render", "--replay", "a.json", "-o", "a.mp4").code == 0
    stamps, length = film_times(Path("a.mp4"))
    assert stamps == pytest.approx([entry.at for entry in recording.entries], abs=1e-4)
    assert length == pytest.approx(recording.seconds, abs=1e-4)


def test_a_film_of_a_picture_is_one_picture(run: Run) -> None:
    assert run("render", "ball.npz", *SMALL, "-o", "a.png").code == 0
    assert run("render", "--replay", "a.png", "-o", "a.mp4").code == 0
    assert len(film(Path("a.mp4"))[0]) == 1


# --- marks ----------------------------------------------------------------------------------------

MARKED = ("--marks", "scale_bar", "color_bar", "stamp", "--unit", "mm")


def test_a_picture_with_marks_is_drawn_again_from_itself(run: Run) -> None:
    choice = ("sequence", "--pose", 2, "--look", "color_by=height", *SMALL)
    assert run("render", *choice, "-o", "bare.png").code == 0
    assert run("render", *choice, *MARKED, "-o", "a.png").code == 0
    assert not np.array_equal(picture(Path("a.png")), picture(Path("bare.png")))
    assert run("render", "--replay", "a.png", "-o", "again.png").code == 0
    assert Path("again.png").read_bytes() == Path("a.png").read_bytes()
    # An EXR holds the surface alone, and still knows them.
    assert run("render", "--replay", "a.png", "-o", "a.exr").code == 0
    assert run("render", "--replay", "bare.png", "-o", "bare.exr").code == 0
    exrs = [run("render", "--replay", f"{n}.exr", "-o", f"{n}.npz").code for n in ("a", "bare")]
    assert exrs == [0, 0]
    with np.load("a.npz") as found, np.load("bare.npz") as expected:
        assert all(np.array_equal(bits(found[name]), bits(expected[name])) for name in expected)
    assert run("render", "--replay", "a.exr", "-o", "again.png", "--force").code == 0
    assert Path("again.png").read_bytes() == Path("a.png").read_bytes()


def test_marks_are_added_to_a_recording_and_to_its_film(run: Run) -> None:
    recorded(Path("a.json"))
    assert run("render", "--replay", "a.json", *MARKED[:4], "-o", "p%d.png").code == 0
    assert run("render", "--replay", "a.json", *MARKED[:4], "--fps", 20, "-o", "a.mp4").code == 0
    first, shown = picture(Path("p0.png"))[..., :3].astype(int), film(Path("a.mp4"))[0][0]
    assert np.abs(first - shown).mean() < 6
    assert run("render", "--replay", "a.json", "-o", "bare%d.png").code == 0
    bare = picture(Path("bare0.png"))[..., :3].astype(int)
    assert np.abs(first - shown).mean() < np.abs(bare - shown).mean() / 2


@pytest.mark.parametrize("suffix", [".exr", ".npz"])
def test_marks_are_for_pictures_that_show_the_look(suffix: str, refused: Callable[..., str]) -> None:
    message = refused("render", "ball.npz", *SMALL, *MARKED, "-o", f"a{suffix}")
    assert all(word in message for word in ("--marks", suffix, ".png", ".mp4")), message
    message = refused("render", "ball.npz", *SMALL, "--marks", "nope", "-o", "a.png")
    assert all(word in message for word in ("'nope'", "scale_bar", "color_bar", "stamp")), message


# --- without names --------------------------------------------------------------------------------


def test_an_anonymous_picture_is_drawn_again_when_its_scan_is_named(
    run: Run, refused: Callable[..., str]
) -> None:
    assert run("render", "ball.npz", *SMALL, "--anonymous", "-o", "a.png").code == 0
    message = refused("render", "--replay", "a.png", "-o", "again.png")
    assert "render SCAN --replay a.png -o again.png" in message
    message = refused("render", "sequence", "--replay", "a.png", "-o", "again.png")
    assert all(word in message for word in ("sequence", "not the scan that a.png shows", "hash")), message
    assert not Path("again.png").exists()
    Path("ball.npz").rename("moved.npz")
    assert run("render", "moved.npz", "--replay", "a.png", "--anonymous", "-o", "again.png").code == 0
    assert Path("again.png").read_bytes() == Path("a.png").read_bytes()


def test_a_scan_that_is_moved_is_drawn_again_where_it_is_also_without_names(run: Run) -> None:
    place = Rigid(np.array([[0.0, -1, 0, 64], [1, 0, 0, -8], [0, 0, 1, 2], [0, 0, 0, 1]]))
    far = PointCloud.from_arrays(sphere(2000).world() + np.array([4096.0, 512, -256]))
    formats.write(Path("far.npz"), far)
    camera = Camera.orbit(place.bounds(far.bounds()), 30, 20, aspect=1.5)
    shown = entry(scan="far.npz", camera=camera, look=Look(color_by="depth"), place=matrix_of(place))
    Recording((shown,)).save(Path("a.json"))
    assert run("render", "--replay", "a.json", "-o", "a.png").code == 0
    assert Recording.load(Path("a.png")).entries[0].place == shown.place
    assert (picture(Path("a.png")) != picture(Path("a.png"))[0, 0]).any(axis=2).mean() > 0.2
    assert run("render", "--replay", "a.json", "--anonymous", "-o", "b.png").code == 0
    assert Recording.load(Path("b.png")).entries[0].place not in (None, shown.place)
    assert run("render", "far.npz", "--replay", "b.png", "-o", "again.png").code == 0
    for name in ("b.png", "again.png"):
        assert np.array_equal(picture(Path(name)), picture(Path("a.png")))


# --- for programs ---------------------------------------------------------------------------------


def test_progress_is_a_line_of_json_a_picture(run: Run) -> None:
    recorded(Path("a.json"))
    done = run("render", "--replay", "a.json", "--progress", "-o", "p%d.png")
    first, *steps, last = done.out.splitlines()
    assert list(json.loads(first)) == ["device"]
    assert [json.loads(step) for step in steps] == [{"drawn": n, "of": 5} for n in range(1, 6)]
    assert last == "p%d.png"


def test_broken_frames_among_several_are_left_out(run: Run, refused: Callable[..., str]) -> None:
    recorded(Path("a.json"))
    Path("sequence/f1.npz").write_bytes(b"no scan")
    done = run("render", "--replay", "a.json", "-o", "p%d.png")
    assert done.code == 0
    assert "leaves out frame 2" in done.err
    assert done.err.count("\n") == 1
    assert sorted(path.name for path in Path().glob("p*.png")) == ["p0.png", "p2.png", "p3.png", "p4.png"]
    Recording((entry(pose=1), entry(pose=1, at=0.2, size=(64, 48)))).save(Path("b.json"))
    assert "f1.npz" in refused("render", "--replay", "b.json", "-o", "q%d.png").splitlines()[-1]


# --- where the scan is ----------------------------------------------------------------------------


def test_a_scan_is_looked_for_beside_the_recording_first(run: Run) -> None:
    Path("inner").mkdir()
    Recording((entry(scan="ball.npz"),)).save(Path("inner/a.json"))
    assert run("render", "--replay", "inner/a.json", "-o", "outer.png").code == 0
    formats.write(Path("inner/ball.npz"), sphere(2000, radius=0.5))
    assert run("render", "--replay", "inner/a.json", "-o", "inner.png").code == 0
    assert not np.array_equal(picture(Path("outer.png")), picture(Path("inner.png")))
    # What was drawn tells where its scan was found.
    assert [e.scan for e in Recording.load(Path("inner.png")).entries] == [str(Path("inner/ball.npz"))]


def test_a_recording_may_turn_from_scan_to_scan(run: Run) -> None:
    Recording((entry(), entry(scan="ball.npz", at=1.0), entry(at=2.0)), 3.0).save(Path("a.json"))
    assert run("render", "--replay", "a.json", "-o", "p%d.png").code == 0
    assert np.array_equal(picture(Path("p0.png")), picture(Path("p2.png")))


def test_a_scan_that_has_changed_is_reported(run: Run) -> None:
    assert run("render", "ball.npz", *SMALL, "-o", "a.png").code == 0
    formats.write(Path("ball.npz"), sphere(2000, radius=1.5))
    done = run("render", "--replay", "a.png", "-o", "again.png")
    assert done.code == 0
    assert done.err == "scan4d: ball.npz: has changed since Scan4D saved a.png, so the pictures may differ\n"


@pytest.mark.parametrize(
    ("shown", "words"),
    [
        (entry(scan="gone.ply"), ["a.json", "'gone.ply'", "cannot find", "working directory"]),
        (entry(scan="/nowhere/gone.ply"), ["/nowhere/gone.ply", "no such file"]),
        (entry(pose=9), ["no pose 9", "0 to 2"]),
        (entry(size=(0, 64)), ["0x64"]),
        (entry(look=Look(color_by="nope")), ["'nope'"]),
    ],
)
def test_what_cannot_be_drawn_is_one_message(
    shown: Entry, words: list[str], refused: Callable[..., str], folder: Path
) -> None:
    Recording((shown,)).save(Path("a.json"))
    before = sorted(folder.iterdir())
    message = refused("render", "--replay", "a.json", "-o", "p.png")
    assert all(word in message for word in words), message
    assert sorted(folder.iterdir()) == before


# --- arguments --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--pose", "0"], ["--pose"]),
        (["--time", "0"], ["--time"]),
        (["--poses", "0:2"], ["--poses"]),
        (["--all"], ["--all"]),
        (["--size", "1920x1280"], ["--size"]),
        (["--backend", "points"], ["--backend"]),
        (["--set", "point_size=3"], ["--set"]),
        (["--look", "light=flat"], ["--look"]),
        (["--camera", "camera.json"], ["--camera"]),
        (["--orbit", "0,0"], ["--orbit"]),
        (["--turntable", "3"], ["--turntable"]),
        (["--up", "+z"], ["--up"]),
        (["ball.npz", "--pose", "1", "--orbit", "3,4"], ["--pose, --orbit"]),
        (["-o", "p.png"], ["p%04d.png", "p.mp4"]),
        (["-o", "p.jpg"], [".jpg", ".png"]),
        (["-o", "p.mp4", "--fps", "0"], ["--fps", "1 to 240"]),
        (["-o", "p.mp4", "--fps", "nan"], ["--fps", "1 to 240"]),
    ],
)
def test_replay_takes_nothing_that_the_recording_tells(
    arguments: list[str], words: list[str], refused: Callable[..., str], folder: Path
) -> None:
    recorded(Path("a.json"))
    Camera().save(Path("camera.json"))
    before = sorted(folder.iterdir())
    message = refused("render", "--replay", "a.json", "-o", "p%d.png", *arguments)
    assert all(word in message for word in words), message
    assert sorted(folder.iterdir()) == before


# --- recordings of others -------------------------------------------------------------------


@pytest.mark.parametrize("name", ["/**/*.ply", "**", "a/**.ply", "*/ball.npz", "[a-z]*/../x", "f%d/a.ply"])
def test_a_recording_does_not_search_through_folders(
    name: str, run: Run, refused: Callable[..., str], tmp_path: Path
) -> None:
    Path("folder").mkdir()
    formats.write(Path("folder") / "ball.npz", sphere(100))
    Recording((entry(scan=name),)).save(Path("a.json"))
    message = refused("render", "--replay", "a.json", "-o", "a.png")
    assert "scan4d render SCAN --replay" in message
    assert refused("view", "a.json", "--fallback", "out") == message
    assert run("render", "sequence", "--replay", "a.json", "-o", "a.png").code == 0


@pytest.mark.parametrize("name", ["sequence/f*.npz", "sequence/f%d.npz", "sequence", "[1]/f0.npz"])
def test_a_recording_opens_what_is_in_one_folder(name: str, run: Run) -> None:
    if name.startswith("["):  # which has the name of a pattern
        Path("sequence").rename("[1]")
    Recording((entry(scan=name),)).save(Path("a.json"))
    assert run("render", "--replay", "a.json", "-o", "a.png") == (0, "a.png\n", "")


@pytest.mark.skipif(sys.platform == "win32", reason="has neither")
@pytest.mark.parametrize("name", ["pipe.json", "pipe.png", "pipe.exr"])
def test_pipes_and_devices_are_no_recordings(name: str, refused: Callable[..., str]) -> None:
    os.mkfifo(name)
    assert "not a regular file" in refused("render", "--replay", name, "-o", "a.png")
    assert "not a regular file" in refused("render", "--replay", "/dev/zero", "-o", "a.png")


@pytest.mark.slow
@pytest.mark.parametrize(
    "choice",
    [["--backend", "surfels"], ["--backend", "points", "--camera", "camera.json"]],
    ids=["perspective", "orthographic"],
)
def test_no_recording_is_an_internal_error(choice: list[str], renderer: Renderer, run: Run) -> None:
    Camera(eye=(0, 0, 5), projection="orthographic", height=3.0, near=1.0, far=9.0).save("camera.json")
    marks = ("--look", "color_by=height", "--marks", "scale_bar", "color_bar", "stamp")
    size = (16, 12)
    assert run("render", "ball.npz", "-o", "a.png", "--size", "16x12", *choice, *marks).code == 0
    drawn = {}
    for description in variants(json.loads(read_description(Path("a.png")))):
        Path("a.json").write_text(json.dumps(description))
        try:
            usable = Recording.load(Path("a.json")).entries[0]
        except InputError:
            pass
        else:
            drawn[usable.description()] = usable
    assert len(drawn) > 100
    surface = Surface(renderer.gpu, size)
    with open_scan("ball.npz") as timeline:
        for usable in drawn.values():
            if usable.pose or usable.size != size:
                continue
            with suppress(InputError):
                while render_frame(renderer, usable.request(timeline.pose(0)), surface):
                    pass
                marked(surface.image(), usable.legend(timeline, timeline.pose(0)), surface.color_range)
