"""What the export dialog makes of the user's choices, and what it refuses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.app.output.export_plan import Choices, free_name, present, problems, recording
from viewer.backends import backend
from viewer.camera import Camera
from viewer.document.recording import Entry
from viewer.look import Look
from viewer.output.legend import Marks
from viewer.output.overlays import DrawnLandmark, DrawnMarks
from viewer.rigid import STILL, Rigid

TIMES: NDArray[np.float64] = np.arange(10, dtype=np.float64) * 0.04
SHOWN = Entry(
    "scan", "sha256:0", 4, 0.16, (944, 587), Camera(eye=(0, 0, 2)), "points", backend("points").params(),
    Look(), unit="mm",
)  # fmt: skip
MARKS = Marks(scale_bar=True)
VIEW = Choices(folder=".", name="a", width=640, height=360)


def made(**changes: object) -> tuple[Choices, tuple[Entry, ...], float]:
    choices = replace(VIEW, **changes)  # type: ignore[arg-type]
    found = recording(choices, SHOWN, MARKS, TIMES, None, lambda _: STILL)
    return choices, found.entries, found.seconds


def test_the_current_view_at_its_own_size_with_marks() -> None:
    choices, entries, _ = made()
    assert entries == (replace(SHOWN, size=(640, 360), marks=MARKS),)
    assert choices.out() == Path("a.png")


def test_its_quality_is_that_of_the_view_or_its_own() -> None:
    assert {entry.look for entry in made(quality="fine")[1]} == {replace(SHOWN.look, quality="fine")}


def test_a_turntable_goes_all_round_from_the_current_view_on() -> None:
    choices, entries, _ = made(what="turntable", pictures=4)
    eyes = np.array([entry.camera.eye for entry in entries])
    assert np.allclose(eyes, [[0, 0, 2], [2, 0, 0], [0, 0, -2], [-2, 0, 0]])
    assert entries[0].camera == SHOWN.camera
    assert {(entry.pose, entry.size) for entry in entries} == {(4, (640, 360))}
    assert choices.out() == Path("a_%04d.png")


def test_a_turntable_turns_about_what_the_view_turns_about() -> None:
    choices = replace(VIEW, what="turntable", pictures=2)
    found = recording(choices, SHOWN, MARKS, TIMES, (0, 0, 1), lambda _: STILL)
    assert np.allclose(found.entries[1].camera.eye, (0, 0, 0))


def test_each_frame_is_where_it_is_moved_to() -> None:
    def place(index: int) -> Rigid:
        return Rigid(np.block([[np.eye(3), np.full((3, 1), index)], [np.zeros((1, 3)), 1]]))

    entries = recording(replace(VIEW, what="frames", last=3), SHOWN, MARKS, TIMES, None, place).entries
    assert [entry.place and entry.place[1] for entry in entries] == [None, (0, 1, 0, 1), (0, 1, 0, 2)]


def test_each_frame_has_what_tools_draw_over_it() -> None:
    def drawn(index: int) -> DrawnMarks:
        return DrawnMarks((DrawnLandmark((float(index), 0.0, 0.0), "a", True),))

    choices = replace(VIEW, what="frames", first=2, last=3)
    frames = recording(choices, SHOWN, Marks(landmarks=True), TIMES, None, lambda _: STILL, drawn).entries
    assert [entry.landmarks[0].place[0] for entry in frames] == [1, 2]
    bare = recording(choices, SHOWN, Marks(notes=True), TIMES, None, lambda _: STILL, drawn).entries
    assert [entry.landmarks for entry in bare] == [(), ()]


def test_a_film_of_frames_keeps_their_pace() -> None:
    choices, entries, seconds = made(what="frames", first=3, last=9, step=2, format="mp4")
    assert [entry.pose for entry in entries] == [2, 4, 6, 8]
    assert [entry.time for entry in entries] == [TIMES[i] for i in (2, 4, 6, 8)]
    assert choices.even_rate(TIMES) == pytest.approx(12.5)
    assert [entry.at for entry in entries] == pytest.approx([0, 0.08, 0.16, 0.24])
    assert seconds == pytest.approx(0.32)
    assert choices.out() == Path("a.mp4")
    assert replace(choices, last=3).even_rate(TIMES) == 25


def test_an_even_film_lasts_as_long_as_its_frames() -> None:
    _, entries, seconds = made(what="frames", format="mp4", fps=50.0)
    assert [entry.at for entry in entries] == pytest.approx(TIMES)
    assert seconds == pytest.approx(0.4)


def test_a_film_of_frames_keeps_their_gaps() -> None:
    times = np.array([3.0, 3.04, 3.2])
    choices = replace(VIEW, what="frames", format="mp4")
    found = recording(choices, SHOWN, MARKS, times, None, lambda _: STILL)
    assert [entry.at for entry in found.entries] == pytest.approx([0, 0.04, 0.2])
    assert found.seconds == pytest.approx(0.36)


def test_a_film_of_a_turntable_is_even() -> None:
    assert [entry.at for entry in made(what="turntable", pictures=3, format="mp4")[1]] == [0, 0.04, 0.08]
    assert made(what="turntable", pictures=3, format="mp4", fps=10.0)[2] == pytest.approx(0.3)


def test_a_film_of_days_is_refused_at_its_times() -> None:
    choices = replace(VIEW, what="frames", format="mp4")
    found = problems(choices, np.arange(4) * 86_400.0, 100_000_000)
    assert list(found) == ["fps"]
    assert "96.0 hours" in found["fps"]


def test_without_a_last_frame_it_goes_to_the_end() -> None:
    assert [entry.pose for entry in made(what="frames", first=9)[1]] == [8, 9]


@pytest.mark.parametrize(
    ("changes", "field", "words"),
    [
        ({"what": "turntable", "pictures": 1}, "pictures", "2 to 3600"),
        ({"what": "frames", "first": 0}, "first", "1 to 10"),
        ({"what": "frames", "first": 11}, "first", "1 to 10"),
        ({"what": "frames", "first": 5, "last": 4}, "last", "5 to 10"),
        ({"what": "frames", "last": 11}, "last", "1 to 10"),
        ({"what": "frames", "step": 0}, "step", "1"),
        ({"width": 0}, "width", "0"),
        ({"height": -4}, "height", "-4"),
        ({"width": 16000, "height": 16000}, "height", "100,000,000"),
        ({"format": "mp4"}, "format", "turntable"),
        ({"what": "turntable", "format": "mp4", "fps": 0.0}, "fps", "1.0 to 240.0"),
        ({"folder": "nowhere"}, "folder", "does not exist"),
        ({"folder": "f" * 300}, "folder", "does not exist"),
        ({"name": " "}, "name", "name"),
        ({"name": "a/b"}, "name", "/"),
        ({"name": "a%d"}, "name", "%"),
        ({"name": "."}, "name", "dot"),
        ({"name": ".."}, "name", "dot"),
        ({"name": "a "}, "name", "space"),
        ({"name": "con"}, "name", "device"),
        ({"name": "LPT1.old"}, "name", "device"),
        ({"name": "ü" * 150}, "name", "200 bytes"),
    ],
)
def test_a_wrong_value_is_said_at_its_field(changes: dict[str, object], field: str, words: str) -> None:
    found = problems(replace(VIEW, **changes), TIMES, 100_000_000)  # type: ignore[arg-type]
    assert list(found) == [field]
    assert words in found[field]


def test_good_choices_have_no_problems() -> None:
    for what in ("view", "turntable", "frames"):
        assert problems(replace(VIEW, what=what), TIMES, 100_000_000) == {}


def test_files_that_are_there_are_found(tmp_path: Path) -> None:
    choices = replace(VIEW, folder=str(tmp_path), what="frames")
    assert present(choices, 10) == []
    for name in ("a_0000.png", "a_0003.png", "a_0010.png", "a.png"):
        (tmp_path / name).touch()
    assert present(choices, 10) == [tmp_path / "a_0003.png", tmp_path / "a_0010.png"]
    assert present(replace(choices, what="view"), 10) == [tmp_path / "a.png"]


def test_files_are_numbered_as_the_window_counts() -> None:
    assert list(replace(VIEW, what="frames", first=3, last=9, step=3).numbers(10)) == [3, 6, 9]
    assert list(replace(VIEW, what="turntable", pictures=3).numbers(10)) == [1, 2, 3]


def test_a_free_name_is_suggested(tmp_path: Path) -> None:
    assert free_name(tmp_path) == "scan4d_0001"
    for name in ("scan4d_0001_0000.png", "scan4d_0003.mp4", "scan4d_12.png"):
        (tmp_path / name).touch()
    assert free_name(tmp_path) == "scan4d_0002"
    (tmp_path / "scan4d_0002.exr").touch()
    assert free_name(tmp_path) == "scan4d_0004"
    assert free_name(tmp_path / ("f" * 300)) == "scan4d_0001"


def test_wrong_values_break_nothing_while_they_are_edited() -> None:
    for changes in ({"first": -7}, {"last": 99}, {"step": 0}, {"first": 9, "last": 2}, {"pictures": -1}):
        choices = replace(VIEW, what="frames", format="mp4", **changes)  # type: ignore[arg-type]
        assert 0 < choices.even_rate(TIMES) <= 240
        assert all(0 <= index < len(TIMES) for index in choices.indices(len(TIMES)))
