"""A recording that was made in the window is shown again in it, frame by frame."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from virtual_screen import ROOT, RunningApp, running_app, virtual_screen

from viewer import cli
from viewer.document.recording import Entry, Recording
from viewer.output.export import read_description
from viewer.scan import formats
from viewer.scan.points import PointCloud

SIZE = (960, 640)


def press(app: RunningApp, key: str) -> None:
    app.screen.do("key", key)


def replay(app: RunningApp) -> None:
    """The recording saved last, to its end."""
    press(app, "shift+r")
    app.see(is_replaying=True)
    app.see(is_replaying=False)
    app.settle()


def recorded(app: RunningApp) -> tuple[Path, tuple[Entry, ...]]:
    """Stop recording; what is in it."""
    press(app, "r")
    path = Path(app.told(r"Saved (.+\.json)")[1])
    return path, Recording.load(path).entries


@contextmanager
def viewed(app: RunningApp, path: Path) -> Iterator[str]:
    """The title of another window, which `scan4d view` opens on a file."""
    command = [sys.executable, "-m", "viewer.cli", "view", str(path)]
    home = dict.fromkeys(("XDG_CONFIG_HOME", "XDG_STATE_HOME"), str(path.parent / "other"))
    env = {**app.screen.env, "PYTHONPATH": str(ROOT), **home}
    windows = set(app.screen.do("search", "--name", "Scan4D").split())
    with subprocess.Popen(command, env=env) as process:
        try:
            while not (new := set(app.screen.do("search", "--name", " - Scan4D").split()) - windows):
                assert process.poll() is None
                time.sleep(0.1)
            yield app.screen.do("getwindowname", new.pop()).strip()
        finally:
            process.kill()


@pytest.mark.slow
def test_the_recording_of_a_replay_is_what_was_recorded_first(tmp_path: Path) -> None:
    for scan in "ab":
        (tmp_path / scan).mkdir()
        for number in range(4):
            np.save(tmp_path / scan / f"{number}.npy", np.random.default_rng(number).random((300, 3)))
    with (
        virtual_screen(tmp_path, SIZE) as screen,
        running_app(screen, tmp_path, tmp_path / "a", tmp_path / "b") as app,
    ):
        press(app, "r")
        app.see(is_recording=True)
        for key, wanted in (
            ("Right", {"frame": 1}), ("b", {"backend": "codeword"}), ("o", {}), ("End", {"frame": 3}),
        ):  # fmt: skip
            press(app, key)
            app.see(**wanted)
            app.settle()
        _, first = recorded(app)
        assert [entry.pose for entry in first] == sorted(entry.pose for entry in first)
        press(app, "ctrl+Home")
        press(app, "shift+b")
        app.see(frame=0, backend="auto_splats")
        app.settle()

        press(app, "r")
        app.see(is_recording=True)
        replay(app)
        path, again = recorded(app)
        assert again[1:] == first, "the first is what was shown before"

        # Another scan is opened for it; without a name, it is shown on the one that is open.
        text = path.read_text()
        other = json.dumps(str(tmp_path / "b"))
        for scan in (other, "null"):
            path.write_text(text.replace(f'"scan": {json.dumps(str(tmp_path / "a"))}', f'"scan": {scan}'))
            press(app, "space")  # a scan that plays is stopped for it,
            press(app, "y")  # and the turntable
            replay(app)
            press(app, "p")
            (shown,) = Recording.load(Path(app.told(r"Saved (.+\.png)")[1])).entries
            assert json.dumps(shown.scan) == other
            assert replace(shown, scan=first[-1].scan) == first[-1]
        path.write_text(text)
        with viewed(app, path) as title:
            assert title == "a - Scan4D"
        path.write_text(text[:-100])
        press(app, "shift+r")
        app.told("is not JSON")
        assert "Traceback" not in app.log()


@pytest.mark.slow
def test_a_replay_shows_the_empty_frames_that_were_recorded(tmp_path: Path) -> None:
    scan = tmp_path / "scan"
    scan.mkdir()
    points = np.random.default_rng(0).random((300, 3))
    for number in range(3):
        rows = "".join(f"{x},{y},{z}\n" for x, y, z in points if number != 1)
        (scan / f"f{number}.csv").write_text("x,y,z\n" + rows)
    with virtual_screen(tmp_path, SIZE) as screen, running_app(screen, tmp_path, scan) as app:
        press(app, "r")
        app.see(is_recording=True)
        press(app, "Right")
        app.see(words="Frame 2 is empty")
        press(app, "Right")
        app.see(frame=2)
        app.settle()
        path, entries = recorded(app)
        assert [entry.pose for entry in entries] == [0, 2]
        empty = replace(entries[0], pose=1, at=(entries[0].at + entries[1].at) / 2)
        replace(Recording.load(path), entries=(entries[0], empty, entries[1])).save(path)
        press(app, "shift+r")
        app.see(is_replaying=True)
        app.see(is_replaying=False, frame=2)
        app.settle()
        assert "replays frame 1" in app.log()
        assert "cannot show" not in app.log()
        assert "Traceback" not in app.log()


@pytest.mark.slow
def test_an_anonymous_picture_is_shown_where_the_scan_stands(tmp_path: Path) -> None:
    scan, picture = tmp_path / "far.npz", tmp_path / "anonymous.png"
    points = np.random.default_rng(0).random((300, 3)) + np.array([5000, 100, 7])
    formats.write(scan, PointCloud.from_arrays(points, scalars={"q": np.arange(300, dtype=np.float32)}))
    with virtual_screen(tmp_path, SIZE) as screen, running_app(screen, tmp_path, scan) as app:
        press(app, "r")
        app.see(is_recording=True)
        path, (shown,) = recorded(app)
        look = replace(shown.look, color_by="q", light="flat")
        wanted = replace(shown, camera=shown.camera.orbited(40, 0), look=look)
        Recording((wanted,)).save(path)
        assert cli.main(["render", "--replay", str(path), "--anonymous", "-o", str(picture)]) == 0
        assert Recording.load(picture).entries[0].camera != wanted.camera
        path.write_text(read_description(picture))
        replay(app)
        press(app, "p")
        (again,) = Recording.load(Path(app.told(r"Saved (.+\.png)")[1])).entries
        assert np.allclose(again.camera.eye, wanted.camera.eye, atol=1e-6)
        assert again.look == wanted.look
        assert not any("has changed since" in note for note in app.notes), (
            "its hash is another one, of the same scan"
        )
        formats.write(scan, PointCloud.from_arrays(points[:200]))
        press(app, "shift+r")
        app.told("far.npz has changed since")
