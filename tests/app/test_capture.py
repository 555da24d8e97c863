"""Recordings and pictures of the window where disks fail; the whole window is in test_window_signals.py."""

from __future__ import annotations

import errno
import os
import threading
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scenes import sphere
from written import picture

from viewer.app.notices import Notices
from viewer.app.output.capture import Capture
from viewer.app.output.export_plan import Choices
from viewer.app.output.exporting import Exporting
from viewer.app.session import Session
from viewer.backends import backend
from viewer.camera import Camera
from viewer.document.journal import Journal, journals, saved
from viewer.document.recording import Recording, fingerprint
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.look import Look
from viewer.output.export import read_description
from viewer.output.legend import Marks
from viewer.rigid import STILL
from viewer.scan.layers import Layers
from viewer.scan.open import open_scan
from viewer.scan.pose import Pose
from viewer.scan.reading.record import Reading
from viewer.scan.reading.sequence import Decided

POSE = Pose(0, 0.0, "ball", sphere(100))


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    home = tmp_path / "home"
    for name in ("HOME", "XDG_STATE_HOME"):
        monkeypatch.setenv(name, str(home))
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    return home


class Poses(list[Pose]):
    """Poses of a scan that nobody corrects."""

    decided = Decided()
    reading = Reading()


@pytest.fixture
def app() -> Any:
    """What Capture needs, with a picture. told: the notes."""
    told: list[str] = []
    request = Request(POSE, Camera.orbit(POSE.cloud.bounds()), "points", backend("points").params(), Look())
    picture = SimpleNamespace(request=request, is_there=True, size=(64, 48))
    session = Session("ball.npz")
    return SimpleNamespace(
        told=told,
        note=told.append,
        viewport=picture,
        session=session,
        playback=SimpleNamespace(unit="mm", timeline=Poses([POSE])),
    )


def no_film(recording: Recording, path: Path) -> None:
    raise AssertionError(path)


def turn(app: Any) -> None:
    """Show another picture."""
    request = app.viewport.request
    app.viewport.request = Request(
        POSE, request.camera.orbited(10, 0), request.backend, request.params, request.look
    )


def colour_by_a_layer(app: Any) -> None:
    """Show a picture whose colours are by numbers that no file has."""
    request, layers = app.viewport.request, Layers({"deviation": np.zeros(len(POSE.cloud))})
    app.viewport.request = replace(request, look=Look(color_by="deviation"), layers=layers)


def test_what_cannot_be_drawn_again_is_not_recorded(app: Any) -> None:
    capture = Capture(app.session, app.playback, app.viewport, app.note, Marks, no_film)
    capture.toggle_recording()
    colour_by_a_layer(app)
    capture.note_shown()
    assert capture.recorder is None
    assert "The recording has stopped: the picture shows the colours 'deviation'" in app.told[-2]
    assert capture.last is not None
    assert len(Recording.load(capture.last).entries) == 1, "what was recorded until then"
    capture.toggle_recording()
    assert capture.recorder is None
    assert "Cannot record: the picture shows the colours 'deviation'" in app.told[-1]


def test_frames_of_which_some_have_computed_colours_are_not_exported(app: Any, tmp_path: Path) -> None:
    bare = replace(POSE, index=1)
    zeros = np.zeros(len(POSE.cloud))
    app.session.change("Colour", look=Look(color_by="deviation"))
    app.session.laid.lay("a", lambda pose: {"deviation": zeros} if pose is POSE else {}, lambda index: STILL)
    for pose in (POSE, bare):
        app.session.laid.layers(pose)
    app.viewport.request = replace(app.viewport.request, pose=bare)
    with closing(open_scan("demo")) as timeline:
        playback = SimpleNamespace(unit="mm", timeline=timeline)
        capture = Capture(app.session, playback, app.viewport, app.note, Marks, no_film)
        exporting = Exporting(
            app.session, playback, app.viewport, app.note, capture.shown,
            lambda: None, choices=Choices(what="frames", folder=str(tmp_path), name="a"), marks=Marks(),
        )  # fmt: skip
        exporting.start()
        (told,) = app.told
        assert "some frames use the colours 'deviation'" in told
        assert exporting.task is None


def test_a_picture_that_cannot_be_drawn_again_is_saved_without_a_text(app: Any) -> None:
    capture = Capture(app.session, app.playback, app.viewport, app.note, Marks, no_film)
    app.session.hash_found.set_result(None)
    image = np.zeros((48, 64, 3), np.uint8)
    app.viewport.surface = SimpleNamespace(image=lambda: image, color_range=None, value_kind=None)
    app.viewport.is_refined = True
    capture.screenshot()
    colour_by_a_layer(app)
    capture.screenshot()
    capture.finish()
    cannot, *saved = app.told
    assert "Scan4D cannot replay this picture: the picture shows the colours 'deviation'" in cannot
    first, second = (Path(words.removeprefix("Saved ")) for words in saved)
    assert Recording.load(first).entries[0].scan == "ball.npz"
    with pytest.raises(InputError):
        read_description(second)


def test_a_journal_that_failed_goes_when_the_recording_is_saved(
    app: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    capture = Capture(app.session, app.playback, app.viewport, app.note, Marks, no_film)
    capture.toggle_recording()

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "no room")

    monkeypatch.setattr(Journal, "add", full)
    for _ in range(3):
        turn(app)
        capture.note_shown()
    assert sum("only in memory" in words for words in app.told) == 1
    assert "the disk is full" in app.told[-1]
    (journal,) = journals()
    assert saved(journal) is None  # nobody else takes a recording that goes on
    capture.toggle_recording()
    assert capture.last is not None
    assert len(Recording.load(capture.last).entries) == 4
    assert journals() == []


def test_a_recording_goes_where_there_is_room(app: Any, tmp_path: Path, home: Path) -> None:
    capture = Capture(app.session, app.playback, app.viewport, app.note, Marks, no_film)
    capture.toggle_recording()
    (tmp_path / "work").rmdir()  # then the working folder is the user's own
    capture.toggle_recording()
    assert capture.last is not None
    assert capture.last.parent == home
    assert journals() == []


def test_a_recording_that_cannot_be_saved_is_kept_and_that_is_told(
    app: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    capture = Capture(app.session, app.playback, app.viewport, app.note, Marks, no_film)
    capture.toggle_recording()

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "no room")

    with monkeypatch.context() as patched:
        patched.setattr(Recording, "save", full)
        capture.toggle_recording()
    assert "saves the recording at the next start" in app.told[-1]
    (journal,) = journals()
    path = saved(journal)
    assert path is not None
    assert len(Recording.load(path).entries) == 1


def test_closing_waits_for_no_question(app: Any) -> None:
    notices, answered = Notices(), threading.Event()
    notices.tell_later(lambda: str(answered.wait()))
    notices.advance(0.0)
    notices.finish()  # or else for ever
    assert notices.all == []
    answered.set()


def test_a_pipe_in_place_of_a_scan_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "scan.npz")
    assert fingerprint([tmp_path / "scan.npz"]) is None
    assert fingerprint([tmp_path / "scan.npz"], "00" * 8) is None


def test_a_saved_picture_says_what_the_colour_bar_of_the_view_does(app: Any) -> None:
    notes = iter(("", "range of 3 of 64 frames"))
    marks = Marks(color_bar=True)
    capture = Capture(
        app.session, app.playback, app.viewport, app.note, lambda: marks, no_film, lambda: next(notes)
    )
    app.session.hash_found.set_result(None)
    app.viewport.request = replace(app.viewport.request, look=Look(color_by="height", range="frame"))
    image = np.zeros((480, 640, 4), np.uint8)
    app.viewport.surface = SimpleNamespace(
        image=lambda: image, color_range=(0.0, 1.0), value_kind=None, request=app.viewport.request
    )
    app.viewport.is_refined = True
    for _ in range(2):
        capture.screenshot()
    capture.finish()
    without, with_it = (picture(Path(words.removeprefix("Saved "))) for words in app.told)
    assert without.any()
    assert (without[..., :3].any(axis=-1) != with_it[..., :3].any(axis=-1)).sum() > 50
