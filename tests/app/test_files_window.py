"""Going from scan to scan in the window: dialog, list, drops, and all of it again at the next start."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from depth_folders import write_color, write_depth, write_matrix
from virtual_screen import PATIENCE, ROOT, RunningApp, Screen, running_app, stored_of

from viewer.app.settings import FILE, load
from viewer.scan.open import DEMO


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Two scans of a file, one of a folder, and a file that is none."""
    study = tmp_path / "study"
    for number, name in enumerate(("one/0.npy", "one/1.npy", "one/2.npy", "three.npy", "two.npy")):
        path = study / name
        path.parent.mkdir(parents=True, exist_ok=True)
        np.save(path, np.random.default_rng(number).random((500, 3)))
    (study / "odd.npz").write_bytes(b"none")
    return study


def ctrl(app: RunningApp, key: str) -> None:
    """As fingers do it: one key after the other."""
    app.screen.do("key", f"ctrl+{key}")


def close(app: RunningApp) -> None:
    ctrl(app, "q")
    assert app.process.wait(PATIENCE) == 0
    assert "Traceback" not in app.log()


def described(app: RunningApp) -> dict[str, Any]:
    """What a screenshot says of itself."""
    from PIL import Image

    app.screen.do("key", "p")
    with Image.open(app.told(r"Saved (.+)")[1]) as file:
        return json.loads(file.text["scan4d"])  # type: ignore[attr-defined]


@pytest.mark.slow
def test_from_scan_to_scan_and_all_of_it_again(screen: Screen, tmp_path: Path, study: Path) -> None:
    with running_app(screen, tmp_path, study / "one") as app:
        ctrl(app, "o")
        app.settle()
        app.do(("key", "Down"), ("key", "Down"))  # from the open scan past odd.npz
        app.settle()
        screen.do("key", "Return")
        app.see(scan=str(study / "three.npy"))
        ctrl(app, "o")
        app.settle()
        app.do(("key", "Tab"), ("type", "--delay", 15, study / "two.npy"))
        app.settle()
        screen.do("key", "Return")
        app.see(scan=str(study / "two.npy"))
        screen.do("key", "Prior")
        app.see(scan=str(study / "three.npy"))
        screen.do("key", "Next")
        app.see(scan=str(study / "two.npy"))
        screen.do("key", "Next")
        app.told(r"Cannot open: \S+study/odd\.npz")
        screen.do("key", "Next")
        app.see(scan=str(study / "one"))
        app.settle()

        app.do(("key", "Right"), ("key", "b"), ("key", "t"), ("key", "e"))
        app.see(every_frame=True)
        app.do(("mousemove", 400, 300), ("click", 4), ("click", 4))
        app.settle()
        left = described(app)
        window = screen.do("search", "--name", "Scan4D").split()[-1]
        screen.do("windowmove", window, 40, 30, "windowsize", window, 1000, 600)
        app.settle()
        close(app)

    settings = tmp_path / "config" / "scan4d" / FILE
    remembered, _ = load(settings)
    assert remembered["scans"]["recent"] == [str(study / name) for name in ("one", "two.npy", "three.npy")]
    assert remembered["window_look"]["theme"] == "light"
    assert remembered["session"]["backend"] is None, "no renderer was chosen for all scans"
    own = stored_of(tmp_path, study / "one")
    assert (own.document.backend, own.pose) == ("codeword", 1)

    np.save(study / "three.npy", np.random.default_rng(9).random((500, 3)) * 1e4 + 1e6)
    with running_app(screen, tmp_path, study / "one") as app:
        place = {"left": 40, "top": 30, "width": 1000, "height": 600, "maximised": False}
        assert app.states[0].place == place
        again = described(app)
        for name in ("pose", "camera", "backend", "params", "look"):
            assert again[name] == left[name], name
        screen.do("key", "Next")
        app.see(scan=str(study / "three.npy"))
        app.settle()
        assert described(app)["camera"]["target"][0] > 1e6, "a camera that shows nothing is not taken up"
        close(app)
    settings.write_text("{")
    with running_app(screen, tmp_path, study / "one") as app:
        app.told(r"settings\.json: is damaged\. Scan4D renamed the file to settings\.old\.json")
        assert described(app)["pose"] == 1, "its document is a file of its own"
        close(app)
    assert settings.with_name("settings.old.json").read_text() == "{"
    assert load(settings)[1] == []


@pytest.mark.slow
def test_what_is_dropped_is_opened_or_told(screen: Screen, tmp_path: Path, study: Path) -> None:
    (study / "wrong.json").write_text("{}")
    (study / "worse 1%.ply").write_bytes(b"no array")
    with running_app(screen, tmp_path, study / "missing.npy", study) as app:
        app.told(r"missing\.npy: no such file")  # and the others are opened
        app.drop(study / "one")
        app.see(scan=str(study / "one"))
        app.drop(*(study / "one" / f"{number}.npy" for number in range(3)))
        app.see(scan=str(study / "one/%d.npy"))
        app.drop(study / "two.npy", study / "gone.ply", study / "three.npy")
        app.told("gone.ply: no such file")
        app.see(scan=str(study / "two.npy"))
        app.settle()
        screen.do("key", "Next")
        app.see(scan=str(study / "three.npy"))
        app.drop(study / "wrong.json")
        app.told("wrong.json: is not a recording")
        app.drop(study / "worse 1%.ply")
        app.told("Cannot open: .*worse 1%.ply")
        app.drop(study / "one", study / "wrong.json")
        app.told(r"Scan4D did not open wrong\.json")
        app.see(scan=str(study / "one"))
        screen.do("key", "r")
        app.see(is_recording=True)
        app.settle()
        screen.do("key", "r")
        recording = app.told(r"Saved (.+\.json)")[1]
        app.drop(recording)
        app.see(is_replaying=True)
        app.see(is_replaying=False)
        app.settle()
        close(app)


@pytest.mark.slow
def test_a_folder_of_range_images_plays_upright(screen: Screen, tmp_path: Path, study: Path) -> None:
    scene = tmp_path / "scene"
    for number in range(3):  # their world is an image's: y goes down
        write_depth(scene / f"frame-{number:06d}.depth.png", np.full((30, 40), 1000 + 50 * number, np.uint16))
        write_color(scene / f"frame-{number:06d}.color.png", np.full((30, 40, 3), 200, np.uint8))
        write_matrix(scene / f"frame-{number:06d}.pose.txt", np.eye(4))
    with running_app(screen, tmp_path, study / "two.npy") as app:
        app.settle()
        app.drop(scene)
        app.see(scan=str(scene), frame=0, unit="m")
        assert app.settle().camera["up"] == [0, -1, 0]
        screen.do("key", "Right")
        app.see(frame=1)
        app.drop(study / "three.npy")
        app.see(scan=str(study / "three.npy"))
        assert app.settle().camera["up"] == [0, 1, 0], "what is up was of the scan before"
        close(app)
    with running_app(screen, tmp_path, scene) as app:
        assert app.settle().camera["up"] == [0, -1, 0]
        close(app)


def broken(folder: Path, count: int) -> Path:
    """Files that are no scans by the names of scans."""
    folder.mkdir(parents=True)
    for number in range(count):
        (folder / f"{number}.npy").write_bytes(b"nothing")
    return folder


@pytest.mark.slow
def test_the_dialog_says_at_the_field_what_cannot_be_opened(
    screen: Screen, tmp_path: Path, study: Path
) -> None:
    damaged = broken(tmp_path / "damaged", 3)
    with running_app(screen, tmp_path, study / "two.npy") as app:
        ctrl(app, "o")
        app.see(is_browser_open=True)
        app.settle()
        for path, why in (
            (study / "missing.ply", r"missing\.ply: no such file"),
            (damaged / "1.npy", r"1\.npy"),
            (damaged / "%d.npy", "Scan4D cannot read any of the 3 frames"),
        ):
            app.do(("key", "Tab"), ("key", "ctrl+a", "type", "--delay", 15, path))
            app.settle()
            screen.do("key", "Return")
            state = app.see(lambda state, why=why: re.search(why, state.refusal))
            assert state.is_browser_open
            assert state.scan == str(study / "two.npy")
            app.settle()
            assert app.notes == [note for note in app.notes if "Cannot" not in note], "told in one place"
            screen.do("key", "Escape")  # the field lets go of the keys
            app.settle()
            if not app.state.is_browser_open:
                ctrl(app, "o")
                app.see(is_browser_open=True)
                app.settle()
        screen.do("type", "thr")
        app.settle()
        screen.do("key", "Return")
        app.see(scan=str(study / "three.npy"), is_browser_open=False)
        close(app)


@pytest.mark.slow
def test_a_folder_that_cannot_be_read_leaves_the_open_scan(
    screen: Screen, tmp_path: Path, study: Path
) -> None:
    damaged = broken(tmp_path / "damaged", 3)
    with running_app(screen, tmp_path, study / "one") as app:
        screen.do("key", "Right")
        app.see(frame=1)
        before = app.settle()
        app.drop(damaged)
        app.told("Cannot open: damaged: Scan4D cannot read any of the 3 frames")
        after = app.settle()
        assert (after.scan, after.frame) == (str(study / "one"), 1)
        assert (after.camera, after.document) == (before.camera, before.document)
        np.save(damaged / "2.npy", np.random.default_rng(0).random((500, 3)))
        app.drop(damaged)
        app.see(scan=str(damaged), frame=2)
        close(app)


@pytest.mark.slow
def test_what_cannot_be_read_at_the_start_is_told_over_the_demo_or_the_next(
    screen: Screen, tmp_path: Path, study: Path
) -> None:
    damaged = broken(tmp_path / "damaged", 2)
    with running_app(screen, tmp_path, damaged / "0.npy") as app:
        app.told(r"Cannot open: \S+0\.npy: cannot be read as NPY")
        app.see(scan=DEMO, is_idle=True)
        assert len([note for note in app.notes if "0.npy" in note]) == 1
        close(app)
    with running_app(screen, tmp_path, damaged) as app:
        app.told("Cannot open: damaged: Scan4D cannot read any of the 2 frames")
        app.see(scan=DEMO, is_idle=True)
        close(app)
    with running_app(screen, tmp_path, tmp_path / "missing.ply") as app:
        app.told(r"Cannot open: \S+missing\.ply: no such file")
        assert app.state.scan == DEMO
        close(app)
    with running_app(screen, tmp_path, damaged / "0.npy", study / "two.npy") as app:
        app.told(r"Cannot open: \S+0\.npy")
        app.see(scan=str(study / "two.npy"), is_idle=True)
        close(app)


def test_the_command_line_opens_the_window_on_what_cannot_be_read(screen: Screen, tmp_path: Path) -> None:
    (tmp_path / "bad.npz").write_text("no scan")
    command = [sys.executable, "-m", "viewer.cli", "view", "bad.npz"]
    env = {**screen.env, "PYTHONPATH": str(ROOT), "XDG_CONFIG_HOME": str(tmp_path / "config")}
    with subprocess.Popen(command, env=env, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process:
        search = ["xdotool", "search", "--name", "demo.* - Scan4D"]
        while subprocess.run(search, env=screen.env, capture_output=True).returncode:
            assert process.poll() is None
            time.sleep(0.1)
        process.terminate()
        _, told = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
    assert "bad.npz: cannot be read as NPZ" in told
    ended = subprocess.run(command, env={**env, "DISPLAY": ""}, cwd=tmp_path, capture_output=True, text=True)
    assert (ended.returncode, ended.stdout) == (2, "")


@pytest.mark.slow
def test_a_card_over_the_demo_goes_with_the_first_act_for_good(screen: Screen, tmp_path: Path) -> None:
    with running_app(screen, tmp_path, DEMO) as app:
        state = app.settle()
        assert not state.is_welcomed
        left, top, width, _ = app.view()
        card = np.s_[top + 20 : top + 100, left + width // 2 - 80 : left + width // 2 + 80]
        there = screen.picture()[card]
        app.do(("key", "Tab"), ("key", "Tab"))
        assert app.settle().is_welcomed
        assert (screen.picture()[card] != there).any()
        close(app)
    with running_app(screen, tmp_path, DEMO) as app:
        assert app.settle().is_welcomed
        close(app)
