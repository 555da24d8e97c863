"""The window outlives its scans: what they lack, their names, and what goes wrong while they are shown."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from scenes import sphere
from virtual_screen import PANEL, PATIENCE, SIZE, RunningApp, Screen, running_app

from viewer.app.loop import _AWAIT
from viewer.document.recording import Recording
from viewer.scan import formats
from viewer.scan.points import PointCloud


def spheres(folder: Path, count: int = 3) -> Path:
    folder.mkdir()
    for index in range(count):
        formats.write(folder / f"{index}.npz", sphere(500, radius=1 + 0.1 * index))
    return folder


@pytest.fixture
def lacking(tmp_path: Path) -> Path:
    """A scan of three frames whose last has no q."""
    folder, points = tmp_path / "lacking", np.random.default_rng(0).standard_normal((300, 3))
    folder.mkdir()
    for index in range(3):
        scalars = {"q": np.arange(300, dtype=np.float32)} if index < 2 else {}
        formats.write(folder / f"{index}.npz", PointCloud.from_arrays(points, scalars=scalars))
    return folder


def close(app: RunningApp) -> None:
    app.screen.do("key", "ctrl+q")
    assert app.process.wait(PATIENCE) == 0


def saved(app: RunningApp, key: str) -> Recording:
    """What a picture or a recording tells, that a key has saved."""
    app.screen.do("key", key)
    return Recording.load(Path(app.told(r"Saved (.+)")[1]))


@pytest.mark.slow
def test_a_frame_and_a_scan_without_the_scalar_are_shown_and_it_comes_back(
    screen: Screen, tmp_path: Path, lacking: Path
) -> None:
    other = spheres(tmp_path / "other", 1)
    with running_app(screen, tmp_path, lacking, other) as app:
        app.choose(PANEL, "color_by/##value", "###q")
        app.settle()
        (with_q,) = saved(app, "p").entries
        assert with_q.look.color_by == "q"
        screen.do("key", "End")
        app.told("Frame 3 has no 'q' to colour by")
        app.settle()
        (without,) = saved(app, "p").entries
        assert (without.pose, without.look.color_by) == (2, "auto")
        screen.do("key", "r")
        app.see(is_recording=True)
        screen.do("key", "e", "key", "space")
        for frame in (0, 1, 2, 1, 2, 0):
            app.see(frame=frame)
        screen.do("key", "space")
        played = saved(app, "r").entries
        assert {(e.look.color_by == "q") == (e.pose < 2) for e in played} == {True}
        screen.do("key", "Page_Down")
        app.see(scan=str(other))
        assert app.settle().document["look"]["color_by"] == "auto", "another scan begins with its own colours"
        screen.do("key", "Page_Up")
        app.see(scan=str(lacking))
        screen.do("key", "ctrl+Home")
        app.settle()
        assert saved(app, "p").entries[0].look.color_by == "q"
        close(app)
    assert sum("has no 'q'" in note for note in app.notes) == 1, "once a scan"
    assert "Traceback" not in app.log()


# Each makes one thing of the window fail as soon as there is a file "fail" in the working directory.
FAILING = """
def fail(name):
    from importlib import import_module
    from os.path import exists
    path, _, name = name.rpartition(".")
    try:
        owner = import_module(path)
    except ImportError:
        path, _, kind = path.rpartition(".")
        owner = getattr(import_module(path), kind)
    whole = getattr(owner, name)
    def failing(*args, **options):
        if exists("fail"):
            raise ValueError("made to fail")
        return whole(*args, **options)
    setattr(owner, name, failing)
"""
PARTS = [
    "viewer.app.panel.appearance._draw", "viewer.app.playing.timeline_bar.TimelineBar._draw_track",
    "viewer.app.scene.cube.OrientationCube.draw", "viewer.app.scene.view.SceneView._take_drag",
    "viewer.app.menu.MenuBar.draw_toolbar",
    "viewer.app.scene.viewport.draw_plan", "viewer.app.scene.viewport.Viewport.present",
    "viewer.app.scene.probe.Probe.pick", "viewer.app.playing.playback.Playback.advance",
    "viewer.app.part.Parts.remembered", "viewer.app.files.opener.Opener._pass_on_messages",
    "viewer.app.app.App.patience", "viewer.app.window.Window.begin", "viewer.app.window.Window.end",
    "viewer.app.shortcuts.Shortcuts.handle",
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", PARTS)
def test_whatever_fails_in_each_frame_is_told_once_and_the_window_goes_on(
    screen: Screen, tmp_path: Path, name: str
) -> None:
    scan = spheres(tmp_path / "scan", 2)
    with running_app(screen, tmp_path, scan, before=FAILING + f"fail({name!r})\n") as app:
        screen.do("key", "r")
        app.see(is_recording=True)
        (tmp_path / "fail").touch()
        screen.do("key", "space")
        for x in range(300, 700, 20):
            screen.do("mousemove", x, 300)
        screen.do("mousemove", 400, 300, "mousedown", 1, "mousemove", 460, 320, "mouseup", 1)
        app.told("made to fail")
        screen.do("key", "space", "mousemove", 2, SIZE[1] - 2)
        begun = app.state.at
        app.see(lambda state: state.at > begun + 3)
        last = [state for state in app.states if state.at > begun + 1]
        assert len(last) < (last[-1].at - last[0].at) / _AWAIT + 2, "it does not spin"
        assert app.process.poll() is None
        app.process.terminate()
        assert app.process.wait(PATIENCE) == 0
    told = [note for note in app.notes if " failed (ValueError: made to fail)" in note]
    assert 1 <= len(told) <= 2, told
    assert app.log().count("Traceback") <= 2
    assert len(list(tmp_path.glob("*.json"))) == 1, "what was recorded is saved"
    if not name.endswith("remembered"):
        assert json.loads((tmp_path / "config" / "scan4d" / "settings.json").read_text())["window_look"]


@pytest.mark.slow
def test_folders_and_files_that_are_no_utf_8(screen: Screen, tmp_path: Path) -> None:
    """The working directory, the scan and its folder; a picture, a recording, its replay, the dialogs."""
    folder = tmp_path / os.fsdecode(b"caf\xe9")
    folder.mkdir()
    scan = spheres(folder / os.fsdecode(b"kn\xf6t"), 2)
    (scan / "0.npz").rename(scan / os.fsdecode(b"0\xff.npz"))
    (scan / "1.npz").rename(scan / os.fsdecode(b"1\xff.npz"))
    with running_app(screen, folder, scan, home=tmp_path) as app:
        screen.do("key", "p")
        app.told(r"Saved .*caf�/scan4d_0001.png")
        screen.do("key", "r")
        app.see(is_recording=True)
        screen.do("key", "Right")
        app.see(frame=1)
        screen.do("key", "r")
        app.told(r"Saved .*caf�/scan4d_0001.json")
        screen.do("key", "shift+r")
        for is_replaying in (True, False):
            app.see(is_replaying=is_replaying)
        assert {0, 1} <= set(app.frames()[-3:])
        app.settle()
        screen.do("key", "ctrl+o")  # the dialog that opens scans
        app.settle()
        screen.do("key", "Escape")
        screen.do("key", "ctrl+e")
        app.see(is_export_open=True)
        app.settle()
        app.do(("key", "Escape"), ("key", "Escape"))
        app.settle()
        close(app)
    assert "Traceback" not in app.log()
    assert not any(" failed (" in note for note in app.notes)
    assert sorted(os.fsencode(path.name) for path in folder.iterdir()) == [
        b"kn\xf6t", b"log", b"scan4d_0001.json", b"scan4d_0001.png",
    ]  # fmt: skip
    assert [entry.scan for entry in Recording.load(folder / "scan4d_0001.json").entries] == [str(scan)] * 2
    kept = json.loads((tmp_path / "config" / "scan4d" / "settings.json").read_text())
    assert kept["scans"]["recent"] == [str(scan)]
    with running_app(screen, folder, scan, home=tmp_path) as app:
        assert app.state.frame == 1, "it was left there"
        close(app)


@pytest.mark.slow
def test_settings_and_keys_that_are_bombs_do_not_keep_the_window_from_opening(
    screen: Screen, tmp_path: Path
) -> None:
    config = tmp_path / "config" / "scan4d"
    config.mkdir(parents=True)
    (config / "keys.toml").write_text("[keys]\nplay = " + "[" * 5000)
    os.mkfifo(config / "settings.json")
    with running_app(screen, tmp_path, spheres(tmp_path / "scan", 1)) as app:
        told = "\n".join(app.notes)
        assert "keys.toml: cannot be read" in told
        assert "settings.json: is not a regular file" in told
        close(app)
