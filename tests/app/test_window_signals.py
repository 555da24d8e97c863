"""However the window is ended, the recording and the settings are there afterwards, whole."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from scenes import rarely, sphere
from virtual_screen import (
    PATIENCE,
    ROOT,
    SIZE,
    RunningApp,
    Screen,
    running_app,
    stored_of,
    virtual_screen,
    wait_until,
)

from viewer.document.recording import Recording
from viewer.scan import formats

COUNT = 30  # frames, which take 1.2 seconds
SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scan")
    for index in range(COUNT):
        formats.write(folder / f"{index:02d}.npz", sphere(500, radius=1 + 0.01 * index))
    return folder


def play_and_record(app: RunningApp) -> None:
    """Until a whole round was recorded."""
    app.screen.do("key", "r")
    app.see(is_recording=True)
    app.screen.do("key", "e", "key", "space")
    for frame in (COUNT // 2, 3, COUNT // 2):
        app.see(frame=frame)


def wait_for_recording(folder: Path) -> Path:
    """Until a closing window has saved one."""
    wait_until(lambda: list(folder.glob("scan4d_*.json")))
    return next(folder.glob("scan4d_*.json"))


def check_recording(path: Path) -> None:
    poses = [entry.pose for entry in Recording.load(path).entries]
    assert len(poses) > COUNT // 2
    assert set(poses) <= set(range(COUNT))


def settings(folder: Path) -> dict[str, object]:
    return json.loads((folder / "config" / "scan4d" / "settings.json").read_text())


def journals(folder: Path) -> list[Path]:
    return [path for path in (folder / "state").rglob("*") if path.is_file()]


@pytest.mark.parametrize("number", [*rarely(signal.SIGINT, signal.SIGHUP), signal.SIGTERM])
def test_a_signal_closes_the_window_and_saves_all(
    screen: Screen, tmp_path: Path, scan: Path, number: int
) -> None:
    with running_app(screen, tmp_path, scan) as app:
        screen.do("key", "t")
        play_and_record(app)
        app.process.send_signal(number)
        path = wait_for_recording(tmp_path)
        app.process.send_signal(number)  # while it closes
        assert app.process.wait(PATIENCE) in (0, -number)  # the latter when all is done, at the very end
    assert "Traceback" not in app.log()
    check_recording(path)
    kept = settings(tmp_path)
    assert kept["window_look"]["theme"] == "light"
    assert stored_of(tmp_path, scan).document.camera is not None
    assert journals(tmp_path) == []
    left = {entry.name for entry in tmp_path.iterdir()}
    assert left == {"config", "state", "log", path.name}


@pytest.mark.slow
def test_settings_are_kept_while_a_scan_plays(screen: Screen, tmp_path: Path, scan: Path) -> None:
    with running_app(screen, tmp_path, scan) as app:
        screen.do("key", "space", "key", "t")
        file = tmp_path / "config" / "scan4d" / "settings.json"
        wait_until(lambda: file.exists() and settings(tmp_path)["window_look"]["theme"] == "light")
        before = app.state.pictures
        app.see(lambda state: state.pictures > before + 1)


@pytest.mark.slow
def test_that_software_draws_is_told_once(screen: Screen, tmp_path: Path, scan: Path) -> None:
    told = []
    for _ in range(2):
        with running_app(screen, tmp_path, scan) as app:
            screen.do("key", "ctrl+q")
            assert app.process.wait(PATIENCE) == 0
            told.append([note for note in app.notes if "draws without a graphics card" in note])
    devices = settings(tmp_path).get("drawing", {}).get("slow_devices", [])
    assert [len(notes) for notes in told] == [len(devices), 0], "nothing is told of a graphics card"


@pytest.mark.slow
def test_what_a_killed_window_had_recorded_is_saved_at_the_next_start(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    with running_app(screen, tmp_path, scan) as app:
        play_and_record(app)
        app.process.kill()
        app.process.wait()
    assert len(journals(tmp_path)) == 2, "the journal and its lock"
    assert list(tmp_path.glob("*.json")) == []
    with running_app(screen, tmp_path, scan) as app:
        told = app.told(r"Saved an unfinished recording: (.+)")
        screen.do("key", "r")
        app.see(is_recording=True)
        for name in ("other", "second"):
            (tmp_path / name).mkdir()
        with (
            virtual_screen(tmp_path / "second", SIZE) as second,
            running_app(second, tmp_path / "other", scan, home=tmp_path) as other,
        ):
            other.settle()
            assert not any("not finished" in note for note in other.notes), "the first one still records"
        assert len(journals(tmp_path)) == 2
    check_recording(Path(told[1]))


@pytest.mark.slow
def test_a_signal_before_the_window_is_there_is_quiet(screen: Screen, tmp_path: Path, scan: Path) -> None:
    """At any moment of the start."""
    env = {
        **screen.env, "PYTHONPATH": str(ROOT),
        "XDG_CONFIG_HOME": str(tmp_path / "config"), "XDG_STATE_HOME": str(tmp_path / "state"),
    }  # fmt: skip
    for turn, number in enumerate(SIGNALS * 2):
        process = subprocess.Popen(
            [sys.executable, "-m", "viewer.cli", "view", scan],
            cwd=tmp_path, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip
        wait_for_libraries(process, ("numpy", "glfw", "imgui")[turn % 3])
        process.send_signal(number)
        out, err = process.communicate(timeout=PATIENCE)
        assert process.returncode in (0, 1, -number), (number, process.returncode, err)
        assert b"Traceback" not in err
        assert out == b""
        assert err in (b"", b"scan4d: stopped\n")


def wait_for_libraries(process: subprocess.Popen[bytes], name: str) -> None:
    """Until the process has loaded one of this name."""
    maps = Path(f"/proc/{process.pid}/maps")
    wait_until(lambda: process.poll() is not None or name in maps.read_text())


def test_signals_that_were_ignored_stay_ignored(screen: Screen, tmp_path: Path, scan: Path) -> None:
    """As nohup has it."""
    ignore = "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
    with running_app(screen, tmp_path, scan, before=ignore) as app:
        os.kill(app.process.pid, signal.SIGHUP)
        screen.do("key", "End")
        app.see(frame=COUNT - 1)
        assert app.process.poll() is None
