"""`scan4d view` up to the window, and what it does without one."""

from __future__ import annotations

import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from small_scans import names
from written import film, film_times, picture

from viewer.document.document import Document
from viewer.document.saved_session import SavedSession
from viewer.errors import NoOpenGLError


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
    frames, _ = film(out / "broken.mp4")
    stamps, length = film_times(out / "broken.mp4")
    assert [*stamps, length] == pytest.approx([0, 0.04, 0.12, 0.16, 0.2], abs=1e-4), "one is left out"
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
    monkeypatch.setattr(
        app, "run", lambda scans, start, **options: calls.append((scans, {**start._asdict(), **options})) or 0
    )
    monkeypatch.setenv("DISPLAY", ":7")
    ball = str(scans / "ball.npz")
    stated = ("--unit", "mm", "--fps", 12, "--up", "-z", "--device", 1, "--average", 8)
    assert run("view", ball, "demo", *stated).code == 0
    assert run("view").code == 0
    opened = [options.pop("opened") for _, options in calls]
    assert [timeline.name for timeline in opened] == ["ball.npz", "demo"], "opened once, and handed over"
    assert (opened[0].unit, opened[0].times[0]) == ("mm", 0.0)
    nothing = {"replay": None, "session": None, "refused": None, "corrections": {}}
    assert calls == [
        ([ball, "demo"], {"unit": "mm", "fps": 12, "up": "-z", "device": 1, "average": 8, **nothing}),
        (["demo"], {"unit": None, "fps": None, "up": None, "device": None, "average": None, **nothing}),
    ]


def test_view_opens_a_session_with_its_scan(
    run: Run, scans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from viewer import app

    calls: list[tuple[object, object]] = []
    refusals: list[object] = []

    def opened(scans: object, start: app.Start, **options: object) -> int:
        calls.append((scans, start.session))
        refusals.append(start.refused)
        return 0

    monkeypatch.setattr(app, "run", opened)
    monkeypatch.setenv("DISPLAY", ":7")
    ball, path = tmp_path / "ball.npz", tmp_path / "a.scan4d.json"
    shutil.copy(scans / "ball.npz", ball)
    SavedSession(str(ball), None, 0, Document(unit="mm")).export(path)
    session = SavedSession.load(path)
    assert session.scan == "ball.npz"
    assert run("view", path).code == 0
    ball.rename(tmp_path / "moved.npz")
    missing = run("view", path)
    words = f"'ball.npz', a scan that Scan4D cannot find. Give the path of the scan: scan4d view SCAN {path}"
    assert words in missing.err
    assert words in str(refusals.pop()), "the window over the demo says so"
    assert calls.pop() == (["demo"], None)
    assert run("view", tmp_path / "moved.npz", path).code == 0
    assert calls == [([str(ball)], session), ([str(tmp_path / "moved.npz")], session)]


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
