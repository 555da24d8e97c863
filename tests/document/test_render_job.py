"""Pictures made by a process of their own: all of them or none, the same as those of the command line."""

from __future__ import annotations

import json
import os
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from scenes import rarely, sphere
from written import film, picture

from viewer.backends import backend
from viewer.camera import Camera
from viewer.document.recording import Entry, Recording
from viewer.document.render_job import make
from viewer.errors import InputError, Scan4DError
from viewer.look import Look
from viewer.output.export import numbered
from viewer.output.legend import Marks
from viewer.scan import formats
from viewer.task import Cancelled, Task

COUNT = 3


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, with the scan doe.npz and the folder out."""
    monkeypatch.chdir(tmp_path)
    formats.write(Path("doe.npz"), sphere(2000))
    Path("out").mkdir()
    return tmp_path


def turned(count: int = COUNT, size: tuple[int, int] = (96, 64)) -> Recording:
    camera = Camera.orbit(sphere(2000).bounds(), 30, 20, aspect=1.5)
    first = Entry(
        "doe.npz", None, 0, 0.0, size, camera, "points", backend("points").params({"point_size": 3}),
        Look(color_by="height"), Marks(scale_bar=True), "mm",
    )  # fmt: skip
    entries = (replace(first, camera=camera.orbited(10.0 * n, 0), at=n / 10) for n in range(count))
    return Recording(tuple(entries), count / 10)


def listed() -> list[str]:
    return sorted(path.name for path in Path("out").iterdir())


def test_pictures_are_those_of_a_replay_and_replace_former_ones(run: Run) -> None:
    Path("out/p1.png").write_bytes(b"former")
    task = Task("export")
    replaced = [Path("out/p1.png")]
    made = make(task, turned(), Path("out/p%d.png"), 25.0, anonymous=False, replaced=replaced)
    assert made.files == tuple(Path(f"out/p{n}.png") for n in range(COUNT))
    assert listed() == ["p0.png", "p1.png", "p2.png"]
    assert (task.progress, made.warnings, bool(made.device)) == (1.0, (), True)
    turned().save(Path("a.json"))
    assert run("render", "--replay", "a.json", "-o", "again%d.png").code == 0
    for number in range(COUNT):
        assert Path(f"again{number}.png").read_bytes() == Path(f"out/p{number}.png").read_bytes()


@pytest.mark.slow
def test_files_bear_the_numbers_that_are_wanted() -> None:
    out = Path("out/p%02d.png")
    made = make(Task("export"), turned(), out, 25.0, anonymous=False, numbers=(1, 5, 9))
    assert made.files == tuple(Path("out", name) for name in ("p01.png", "p05.png", "p09.png"))
    assert listed() == ["p01.png", "p05.png", "p09.png"]


@pytest.mark.slow
def test_a_film_has_its_pace(run: Run) -> None:
    made = make(Task("export"), turned(), Path("out/a.mp4"), 10.0, anonymous=False)
    frames, rate = film(made.files[0])
    assert (len(frames), rate, frames[0].shape) == (COUNT, 10, (64, 96, 3))


def test_an_anonymous_picture_tells_no_name_and_no_path(run: Run, folder: Path) -> None:
    (file,) = make(Task("export"), turned(1), Path("out/a.png"), 25.0, anonymous=True).files
    data = file.read_bytes()
    assert b"doe" not in data
    assert str(folder).encode() not in data
    assert run("render", "doe.npz", "--replay", file, "-o", "again.png").code == 0
    assert np.array_equal(picture(Path("again.png")), picture(file))


@pytest.mark.slow
def test_an_anonymous_film_draws_no_names() -> None:
    ball = sphere(2000)
    formats.write(Path("doe.npz"), replace(ball, scalars={"janedoe": ball.positions[:, 1].copy()}))
    look, marks = Look(color_by="janedoe"), Marks(color_bar=True)
    (entry,) = turned(1, (320, 240)).entries
    shown = Recording((replace(entry, look=look, marks=marks),) * 2, 0.1)
    named, hidden = (
        film(make(Task("export"), shown, Path("out/a.mp4"), 25.0, anonymous=anonymous).files[0])[0][0]
        for anonymous in (False, True)
    )
    assert np.abs(named.astype(int) - hidden).max() > 100, "the name of the scalar"


def test_cancelled_on_the_way_nothing_is_left() -> None:
    Path("out/p0000.png").write_bytes(b"former")
    task = Task("export")
    reached = threading.Event()

    def report(progress: float) -> None:
        reached.set()
        task.cancel()

    task.report = report  # type: ignore[method-assign]
    with pytest.raises(Cancelled):
        make(task, turned(200, (640, 480)), Path("out/p%04d.png"), 25.0, anonymous=False)
    assert reached.is_set(), "it had begun"
    assert listed() == ["p0000.png"]
    assert Path("out/p0000.png").read_bytes() == b"former"
    with pytest.raises(Cancelled):
        make(task, turned(), Path("out/p%04d.png"), 25.0, anonymous=False)
    assert listed() == ["p0000.png"]


def test_what_fails_is_one_message_and_leaves_nothing() -> None:
    gone = replace(turned().entries[0], scan="gone.ply")
    with pytest.raises(Scan4DError) as caught:
        make(Task("export"), Recording((gone,)), Path("out/a.png"), 25.0, anonymous=False)
    assert "gone.ply" in str(caught.value)
    assert "scan4d:" not in str(caught.value)
    assert "\n" not in str(caught.value)
    assert listed() == []
    large = turned(1, (20_000, 16_000))
    with pytest.raises(Scan4DError, match="20000x16000 pixels is too large"):
        make(Task("export"), large, Path("out/a.png"), 25.0, anonymous=False)
    with pytest.raises(InputError, match="cannot be written"):
        make(Task("export"), turned(), Path("nowhere/a.png"), 25.0, anonymous=False)


def test_broken_frames_are_told(folder: Path) -> None:
    Path("s").mkdir()
    formats.write(Path("s/a.npz"), sphere(2000))
    Path("s/b.npz").write_bytes(b"broken")
    first = replace(turned().entries[0], scan="s")
    made = make(
        Task("export"), Recording((first, replace(first, pose=1))), Path("out/p%d.png"), 25.0, anonymous=False
    )
    assert listed() == ["p0.png"]
    assert len(made.warnings) == 1
    assert "leaves out frame 2" in made.warnings[0]


@pytest.mark.slow
def test_modules_of_the_working_directory_are_not_taken_for_scan4d() -> None:
    Path("viewer").mkdir()
    Path("viewer/__init__.py").write_text("raise SystemExit('taken')")
    Path("json.py").write_text("raise SystemExit('taken')")
    (file,) = make(Task("export"), turned(1), Path("out/a.png"), 25.0, anonymous=False).files
    from viewer.output.export import read_description

    assert json.loads(read_description(file))["scan"] == "doe.npz"


@pytest.mark.slow
@pytest.mark.parametrize("name", [*rarely("p.png", "p.mp4"), "p%02d.png"])
def test_files_that_have_come_meanwhile_stay_and_all_are_called_differently(name: str) -> None:
    out = Path("out", name)
    former = numbered(out, 1)
    former.write_bytes(b"former")
    several = "%" in name or name.endswith("mp4")
    made = make(Task("export"), turned(COUNT if several else 1), out, 25.0, anonymous=False)
    assert former.read_bytes() == b"former"
    stem = out.stem + "_2"
    expected = dict.fromkeys(numbered(out.with_stem(stem), n) for n in range(COUNT if several else 1))
    assert made.files == tuple(expected)
    assert listed() == sorted([former.name, *(path.name for path in expected)])


@pytest.mark.slow
def test_the_folder_names_the_scan_no_longer_than_it_takes_to_read_that(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    named = []

    class Watched(Task):
        def report(self, progress: float) -> None:
            files = [path for path in Path("out").rglob("*") if path.is_file() and not path.suffix]
            named.append([path for path in Path("out").rglob("*.json")])
            assert all(b"doe" not in path.read_bytes() for path in files)

    make(Watched("export"), turned(), Path("out/p%d.png"), 25.0, anonymous=True)
    assert named == [[]] * COUNT


@pytest.mark.slow
def test_folders_and_scans_that_are_no_utf_8(folder: Path) -> None:
    cafe = Path(os.fsdecode(b"caf\xe9"))
    cafe.mkdir()
    Path("doe.npz").rename(cafe / "doe.npz")
    first = replace(turned(1).entries[0], scan=str(cafe / "doe.npz"))
    (file,) = make(Task("export"), Recording((first,)), cafe / "a.png", 25.0, anonymous=False).files
    assert Recording.load(file).entries[0].scan == first.scan
    gone = Recording((replace(first, scan="gone.ply"), first))
    with pytest.raises(Scan4DError) as caught:
        make(Task("export"), Recording((gone.entries[0],)), cafe / "b.png", 25.0, anonymous=False)
    assert ".scan4d_" not in str(caught.value)
    assert sorted(path.name for path in cafe.iterdir()) == ["a.png", "doe.npz"]


@pytest.mark.slow
def test_a_scan_that_a_recording_may_not_ask_for_is_named_beside_it() -> None:
    Path("a").mkdir()
    Path("doe.npz").rename("a/doe.npz")
    first = replace(turned(1).entries[0], scan="*/doe.npz")
    (file,) = make(Task("export"), Recording((first,)), Path("out/a.png"), 25.0, anonymous=False).files
    assert Recording.load(file).entries[0].scan == "*/doe.npz"
