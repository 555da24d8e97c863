"""The document in the real window: undo and redo of whatever was done, and what comes back after a kill."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from virtual_screen import (
    PANEL,
    ROOT,
    RunningApp,
    Screen,
    running_app,
    stored_of,
    wait_until,
    wait_until_stored,
)
from written import picture

from viewer.camera import Camera
from viewer.document.document import Document
from viewer.document.landmarks import Landmarks
from viewer.document.saved_session import SavedSession
from viewer.scan import formats
from viewer.scan.points import PointCloud

CAMERA = Camera((0.0, -4.0, 1.0), (0.0, 0.0, 0.5), (0.0, 0.0, 1.0))


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    """Three frames of a wall with a bump, with normals and a scalar."""
    folder = tmp_path / "scans" / "wall"
    folder.mkdir(parents=True)
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-1, 1, 120), np.linspace(-1, 1, 120)))
    for number in range(3):
        z = np.exp(-4 * (x**2 + y**2)) * (1 + number / 4)
        normals = np.stack([8 * x * z, 8 * y * z, np.ones(x.size)], axis=1)
        cloud = PointCloud.from_arrays(np.stack([x, y, z], axis=1), normals=normals, scalars={"bump": z})
        formats.write(folder / f"{number}.npz", cloud)
    return folder


class Hands:
    """What a person does to the window, and what comes of it. states: documents, in order of the steps."""

    def __init__(self, app: RunningApp) -> None:
        self.app = app
        left, top, width, height = app.view()
        self.middle = left + width // 2, top + height // 2

    def press(self, *keys: str) -> None:
        self.app.press(*keys)

    def move(self, right: int = 0, down: int = 0) -> None:
        self.app.screen.do("mousemove", self.middle[0] + right, self.middle[1] + down)
        self.app.settle()

    def drag(self, button: int, right: int, down: int) -> None:
        x, y = self.middle
        self.app.drag((x, y), (x + right // 2, y + down // 2), (x + right, y + down), button=button)

    def wheel(self, button: int, times: int) -> None:
        self.move(20, 10)
        self.app.screen.do("click", "--repeat", times, "--delay", 30, button)
        self.app.settle()
        self.app.see(is_step_open=False)  # or else it would go on

    def click(self, right: int, down: int, times: int = 1) -> None:
        self.move(right, down)
        self.app.screen.do("click", "--repeat", times, "--delay", 0, 1)
        self.app.settle()

    def slide(self, parameter: str, right: int) -> None:
        """Drag in the panel."""
        self.app.act(PANEL, ("item_drag_with_delta", f"{parameter}/##value", (right, 0)))

    def turn(self) -> None:
        """By the turntable."""
        before = self.app.state.camera
        self.app.screen.do("key", "y")
        self.app.see(lambda state: state.camera != before)
        self.app.screen.do("key", "y")
        self.app.settle()

    def measure(self, right: int) -> None:
        self.press("m")
        self.click(-60, 40)
        self.click(right, -30)
        self.press("m")

    def shot(self) -> NDArray[np.uint8]:
        self.app.screen.do("key", "p")
        return picture(Path(self.app.told(r"Saved (.+)")[1]))


def mixed(hands: Hands) -> list[Callable[[], object]]:
    """Ways to change the document, each a step."""
    return [
        lambda: hands.drag(1, 120, 40), lambda: hands.wheel(4, 3), lambda: hands.press("o"),
        lambda: hands.press("ctrl+b"), lambda: hands.press("b"), lambda: hands.drag(2, -60, 30),
        lambda: hands.measure(70), lambda: hands.slide("ambient", 40), lambda: hands.press("ctrl+3"),
        lambda: hands.press("ctrl+b"), lambda: hands.drag(3, 0, 40), lambda: hands.press("ctrl+1"),
        lambda: hands.click(30, 20, times=2), hands.turn, lambda: hands.press("f"),
        lambda: hands.press("n"), lambda: hands.press("o"), lambda: hands.wheel(5, 2),
    ]  # fmt: skip


@pytest.mark.slow
def test_fifty_mixed_actions_are_undone_by_keys_to_the_same_document_and_picture_and_redone(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    with running_app(screen, tmp_path, scan) as app:
        hands = Hands(app)
        first, documents, names = hands.shot(), [app.state.document], []
        ways = mixed(hands)
        number = 0
        while len(names) < 50:
            ways[number % len(ways)]()
            state = app.settle()
            number += 1
            if state.document != documents[-1]:
                documents.append(state.document)
                names.append(state.undoes)
            assert number < 80, f"too little is changed: {names}"
        assert len(set(names)) > 10, names
        hands.press("Right", "Right", "Left", "Left")  # frames are no changes of the document
        last = hands.shot()
        assert np.abs(last.astype(int) - first).max() > 20

        for document, name in zip(documents[-2::-1], names[::-1], strict=True):
            assert app.settle().undoes == name
            screen.do("key", "ctrl+z")
            assert app.settle().document == document, name
        assert app.state.undoes is None
        np.testing.assert_array_equal(hands.shot(), first)

        for way, (document, name) in enumerate(zip(documents[1:], names, strict=True)):
            assert app.settle().redoes == name
            screen.do("key", ("ctrl+y", "ctrl+shift+z")[way % 2])
            assert app.settle().document == document, name
        assert app.state.redoes is None
        np.testing.assert_array_equal(hands.shot(), last)
        assert "Traceback" not in app.log()


@pytest.mark.slow
def test_what_was_done_a_moment_before_a_kill_comes_back(screen: Screen, tmp_path: Path, scan: Path) -> None:
    with running_app(screen, tmp_path, scan) as app:
        hands = Hands(app)
        hands.press("Right")
        hands.measure(60)
        hands.press("o", "ctrl+b", "b")
        done = app.settle()
        wait_until_stored(tmp_path, scan, done)
        app.process.send_signal(signal.SIGKILL)
        app.process.wait()
    kept = stored_of(tmp_path, scan)
    assert len(kept.document.part(Landmarks).distances) == 1
    assert str(kept.hash).startswith("content:")
    with running_app(screen, tmp_path, scan) as app:
        state = app.settle()
        assert state.document == done.document
        assert (state.frame, state.backend) == (1, done.backend)
        assert state.undoes is None
    folder = tmp_path / "config" / "scan4d" / "scans"
    assert [path.suffix for path in folder.iterdir()] == [".json"]
    for number in range(3):
        formats.write(scan / f"{number}.npz", PointCloud.from_arrays(np.eye(3) + number))
    with running_app(screen, tmp_path, scan) as app:
        app.told("The files of the scan have changed since Scan4D saved your work")


def saved_session(app: RunningApp, name: str) -> Path:
    """Saved by the dialog, under this name."""
    app.screen.do("key", "ctrl+shift+s")
    app.settle()
    app.screen.do("type", "--delay", 40, name)
    app.settle()
    app.screen.do("key", "Return")
    return Path(app.told("Saved (.*)")[1])


def open_and_find(app: RunningApp, session: Path, scan: Path, document: object) -> None:
    """Drop a session whose scan is missing, and name the folder where it is now."""
    app.drop(session)
    app.told("cannot find the scan 'scans/wall' of this session")
    app.settle()
    app.act("problems", ("item_click", "$$0/Locate scan..."))
    app.see(is_browser_open=True)
    app.settle()
    Hands(app).press("Tab")
    app.screen.do("type", "--delay", 15, scan)
    app.settle()
    app.screen.do("key", "Return")  # into the folder
    app.settle()
    app.screen.do("key", "Return")  # all of it
    app.see(lambda state: state.scan == str(scan) and state.document == document, frame=1)
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_a_session_whose_scan_is_missing_asks_for_it(screen: Screen, tmp_path: Path, scan: Path) -> None:
    (tmp_path / "else").mkdir()
    file = tmp_path / "else" / "mine.scan4d.json"
    document = Document(backend="points", camera=CAMERA)
    SavedSession(str(scan), None, 1, document).export(file)
    data = json.loads(file.read_text())
    file.write_text(json.dumps(data | {"scan": "scans/wall"}))
    wanted = json.loads(file.read_text())["document"]
    home = tmp_path / "another"
    home.mkdir()
    other = home / "other.npy"
    np.save(other, np.random.default_rng(0).random((300, 3)))
    with running_app(screen, home, other) as app:
        open_and_find(app, file, scan, wanted)


@pytest.mark.slow
def test_a_session_is_saved_moved_and_opened_and_its_scan_asked_for(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    with running_app(screen, tmp_path, scan) as app:
        hands = Hands(app)
        hands.press("Right", "ctrl+b", "o")
        hands.measure(60)
        path = saved_session(app, "mine")
        assert path == tmp_path / "mine.scan4d.json"
        done = app.settle()
        hands.press("ctrl+4", "b", "ctrl+Home")
        changed = app.settle().document
        app.drop(path)
        assert app.see(document=done.document, frame=1).undoes == "Open session"
        screen.do("key", "ctrl+z")
        app.see(document=changed)
    session = SavedSession.load(path)
    assert (session.scan, session.pose) == ("scans/wall", 1)

    (tmp_path / "else").mkdir()
    moved = tmp_path / "else" / path.name
    path.rename(moved)
    home = tmp_path / "another"
    home.mkdir()
    with running_app(screen, home, "demo") as app:
        open_and_find(app, moved, scan, done.document)


@pytest.mark.slow
def test_a_session_of_which_a_part_cannot_be_read_and_whose_renderer_is_not_there_is_shown_and_kept(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    with running_app(screen, tmp_path, scan) as app:
        hands = Hands(app)
        hands.press("Right", "ctrl+b", "b")
        hands.measure(60)
        path = saved_session(app, "mine")
        data: dict[str, Any] = json.loads(path.read_text())
        measured = data["document"]["parts"]["landmarks"]
        measured["all"][0]["note"] = "left"
        data["document"]["backend"] = "cubist"
        path.write_text(json.dumps(data))
        hands.press("ctrl+Home", "ctrl+4")
        app.drop(path)
        app.told("cannot read some of your saved work on this scan: parts.landmarks")
        app.told("This version of Scan4D has no renderer 'cubist'. .* draws the scan instead")
        state = app.see(frame=1)
        assert state.document["backend"] == "cubist"
        assert state.document["camera"] == data["document"]["camera"]
        assert state.document["bookmarks"] == data["document"]["bookmarks"]
        assert state.document["parts"]["landmarks"] == measured
        hands.measure(60)
        after = app.settle().document
        assert len(after["parts"]["landmarks"]["measures"]) == 1
        assert after["unread"] == {"parts.landmarks": measured}
        assert "cannot be drawn" not in app.log()
        assert "Traceback" not in app.log()


def view(screen: Screen, home: Path, *words: object) -> subprocess.CompletedProcess[str]:
    """`scan4d view` until it ends, without a display."""
    command = [sys.executable, "-m", "viewer.cli", "view", *map(str, words)]
    env = {**screen.env, "PYTHONPATH": str(ROOT), "XDG_CONFIG_HOME": str(home), "DISPLAY": ""}
    return subprocess.run(command, env=env, capture_output=True, text=True, cwd=home)


@pytest.mark.slow
def test_the_command_line_opens_a_session_and_tells_what_is_wrong(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    with running_app(screen, tmp_path, scan) as app:
        Hands(app).press("o", "Right")
        path = saved_session(app, "mine")
        done = app.settle().document
    home = tmp_path / "another"
    home.mkdir()
    environment = {**screen.env, "PYTHONPATH": str(ROOT), "XDG_CONFIG_HOME": str(home / "config")}
    command = [sys.executable, "-m", "viewer.cli", "view", str(path)]
    with subprocess.Popen(command, env=environment, cwd=home) as process:
        wait_until(lambda: list(home.glob("config/**/scans/*.json")))
        process.terminate()
    assert json.loads(json.dumps(stored_of(home, scan).to_json()))["document"] == done
    assert stored_of(home, scan).pose == 1

    def refused(*words: object) -> str:
        ended = view(screen, home, *words)
        assert (ended.returncode, ended.stdout) == (2, "")
        return ended.stderr

    scan.rename(scan.parent / "gone")
    assert (
        f"'scans/wall', a scan that Scan4D cannot find. Give the path of the scan: scan4d view SCAN {path}"
        in refused(path)
    )
    data: dict[str, Any] = json.loads(path.read_text())
    path.write_text(json.dumps(data | {"document": 3}))
    assert f"{path}, document: must be an object with named values, not 3" in refused(path)
    path.write_text("{")
    assert "is not JSON" in refused("demo", path)
