"""A screen in memory with real key and mouse events, and the app running on it."""

from __future__ import annotations

import ctypes
import itertools
import json
import math
import os
import re
import shutil
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple, TypeVar

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.document.saved_session import SavedSession, stored_file

ROOT = Path(__file__).resolve().parents[2]
PANEL = "panel/settings"  # name of the window's part with the parameters
SIZE = (1024, 640)  # of the screen that tests share, pixels
PATIENCE = 120.0  # seconds until what does not come about counts as failed

_READ_CLIPBOARD = """
import glfw, sys
glfw.init()
glfw.window_hint(glfw.VISIBLE, False)
sys.stdout.buffer.write(glfw.get_clipboard_string(glfw.create_window(8, 8, "", None, None)))
"""

_SLOW_PICTURES = """
import time
from viewer.app.window import Window
end = Window.end
def end_late(self):
    time.sleep({})
    end(self)
Window.end = end_late
"""

Found = TypeVar("Found")


class Screen:
    """A display of Xvfb. picture() is what a person would see."""

    def __init__(self, display: str, frame: Path) -> None:
        self.env = {**os.environ, "DISPLAY": display}
        self._frame = frame  # XWD, https://www.x.org/releases/X11R7.7/doc/xwd

    def picture(self) -> NDArray[np.uint8]:
        """(H, W, 3) uint8."""
        data = self._frame.read_bytes()
        header = struct.unpack(">25I", data[:100])
        start, width, height, row_bytes = header[0] + 12 * header[19], header[4], header[5], header[12]
        rows = np.frombuffer(data, np.uint8, row_bytes * height, start).reshape(height, row_bytes)
        return rows[:, : 4 * width].reshape(height, width, 4)[..., 2::-1]

    def do(self, *words: object) -> str:
        """An xdotool command line; real events."""
        command = ["xdotool", *map(str, words)]
        return subprocess.run(command, env=self.env, check=True, capture_output=True, text=True).stdout

    def clipboard(self) -> str:
        """What another program would paste; tests' own actions on widgets by name do not reach it."""
        command = [sys.executable, "-c", _READ_CLIPBOARD]
        return subprocess.run(command, env=self.env, check=True, capture_output=True).stdout.decode()


def set_scale(display: str, scale: float) -> None:
    """Tell programs as desktops do: by Xft.dpi, 96 at scale 1, in the resources of the root window."""
    x11 = ctypes.CDLL("libX11.so.6")
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XDefaultRootWindow.restype = ctypes.c_ulong
    opened = ctypes.c_void_p(x11.XOpenDisplay(display.encode()))
    root = ctypes.c_ulong(x11.XDefaultRootWindow(opened))
    text = f"Xft.dpi:\t{96 * scale:g}\n".encode()
    resource_manager, string, replace = 23, 31, 0  # XA_RESOURCE_MANAGER, XA_STRING, PropModeReplace
    x11.XChangeProperty(opened, root, resource_manager, string, 8, replace, text, len(text))
    x11.XCloseDisplay(opened)


@contextmanager
def virtual_screen(folder: Path, size: tuple[int, int], scale: float = 1) -> Iterator[Screen]:
    """A screen on a free display. Skips the test where Xvfb or xdotool is missing.

    scale: that programs should draw text and widgets at.
    """
    for tool in ("Xvfb", "xdotool"):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")
    reading, writing = os.pipe()
    screen = ["-screen", "0", f"{size[0]}x{size[1]}x24"]
    server = subprocess.Popen(
        ["Xvfb", "-noreset", "-displayfd", str(writing), *screen, "-fbdir", folder],
        pass_fds=[writing],
        stderr=subprocess.DEVNULL,
    )
    os.close(writing)
    try:
        with open(reading) as line:
            display = f":{line.readline().strip()}"
        if scale != 1:
            set_scale(display, scale)
        yield Screen(display, folder / "Xvfb_screen0")
    finally:
        server.terminate()
        server.wait()


class Report(NamedTuple):
    """What a walk through widgets came by. seen: their windows and labels, in order. problems: what ImGui
    found wrong."""

    seen: list[str]
    problems: list[str]


class State(SimpleNamespace):
    """What the app showed at the end of a turn of its loop, as observed.py has it."""


class RunningApp:
    """The app as a process of its own. It tells what it shows by states, one after each turn of its loop."""

    def __init__(self, screen: Screen, process: subprocess.Popen[bytes], states: int, log: Path) -> None:
        self.screen, self.process, self.folder = screen, process, log.parent
        self.states: list[State] = []
        self.notes: list[str] = []  # all that it has told its user
        self._log = log
        self._came = threading.Condition()
        self._seen = self._told = 0  # how many of them were looked at
        self._asked = 0
        self._reader = threading.Thread(target=self._read, args=[states], daemon=True)
        self._reader.start()

    def _read(self, states: int) -> None:
        with open(states) as lines:
            for line in lines:
                state = State(**json.loads(line))
                with self._came:
                    self.states.append(state)
                    self.notes += state.notes
                    self._came.notify_all()
        with self._came:
            self._came.notify_all()

    def log(self) -> str:
        """All that it has written to standard error."""
        return self._log.read_text(errors="replace")

    @property
    def state(self) -> State:
        """The last one."""
        return self.states[-1]

    def see(self, what: Callable[[State], object] = lambda _: True, **wanted: object) -> State:
        """Wait for a state of which this is true and that has these values.

        None before the one that was seen last; fails when the app ends.
        """

        def find() -> State | None:
            for index in range(self._seen, len(self.states)):
                self._seen, state = index, self.states[index]
                if all(getattr(state, name, None) == value for name, value in wanted.items()) and what(state):
                    return state
            return None

        return self._wait(find, wanted or what)

    def told(self, pattern: str) -> re.Match[str]:
        """Wait for a note to the user, after the one that was found last, in which this is found."""

        def find() -> re.Match[str] | None:
            while self._told < len(self.notes):
                self._told += 1
                if found := re.search(pattern, self.notes[self._told - 1]):
                    return found
            return None

        return self._wait(find, pattern)

    def take_in(self) -> State:
        """Wait until all events so far were taken in, whatever goes on; the state then."""
        return self._ask()

    def settle(self) -> State:
        """Wait until all events so far were taken in, and nothing goes on any longer."""
        self.take_in()
        return self.see(lambda state: state.is_idle)

    def do(self, *commands: Sequence[object]) -> None:
        """Command lines of xdotool, each of which the window takes in before the next begins.

        A window that is slow would see several as one.
        """
        for number, command in enumerate(commands):
            if number > 0:
                self.take_in()
            self.screen.do(*command)

    def press(self, *keys: str) -> State:
        """Press keys, each when what the one before does is done; the state then."""
        for key in keys:
            self.screen.do("key", key)
            self.settle()
        return self.settle()

    def drag(self, *places: tuple[float, float], button: int = 1) -> State:
        """Press a button at the first place of the screen, go from place to place, let go at the last."""
        start, *moves = [("mousemove", round(x), round(y)) for x, y in places]
        self.do(start, ("mousedown", button), *moves, ("mouseup", button))
        return self.settle()

    def act(self, window: str, *actions: tuple[object, ...], ends: bool = False) -> None:
        """Act on a window's widgets by their names, when all events so far were taken in.

        window: its name; a part of it that scrolls by itself has its own below that. actions: methods of
        TestContext of ImGui's test engine and their arguments, as ("item_click", "Time each pass"). Sections
        of the panel are opened where they hide a widget. ends: whether the app ends by that, which is not
        waited for.
        """
        if ends:
            self._send(window, *actions)
            return
        problem = self._ask(window, *actions).problem
        assert not problem, f"{window}: {actions}: {problem}"

    def walk(
        self, windows: Collection[str] = (), *, presses: bool = True, part: tuple[int, int] = (0, 1)
    ) -> Report:
        """Go through the widgets of these windows, or of all, and through what they open (see walking.py).

        Those that end or hide the window are only hovered. presses: whether to drag and click the others.
        part: its number, and how many there are that share the widgets.
        """
        skipped = ["quit", "full_screen", "panels"]
        self._send("toolbar", ("walk", list(windows), presses, skipped, part))
        end = self._wait(
            lambda: self.state if self.state.answered == self._asked else None, "a walk", math.inf
        )
        return Report(*json.loads(end.problem))

    def choose(self, window: str, combo: str, item: str) -> None:
        """An item of the list that a combo box opens, both by their names."""
        self.act(window, ("item_click", combo), ("item_click", f"//$FOCUSED/{item}"))

    def _ask(self, *task: object) -> State:
        """The first state after all events so far were taken in, and a task for acting.py is done."""
        self._send(*task)
        return self.see(answered=self._asked)

    def _send(self, *task: object) -> None:
        assert self.process.stdin is not None
        self._asked += 1
        self.process.stdin.write(json.dumps([self._asked, task]).encode() + b"\n")
        self.process.stdin.flush()

    def _wait(self, find: Callable[[], Found | None], wanted: object, patience: float = PATIENCE) -> Found:
        deadline = time.monotonic() + patience
        with self._came:
            while (found := find()) is None:
                seconds = deadline - time.monotonic()
                assert self._reader.is_alive(), f"the app has ended without {wanted}:\n{self.log()[-5000:]}"
                assert seconds > 0, f"no {wanted} in time:\n{self.states[-1:]}\n{self.log()[-5000:]}"
                self._came.wait(min(seconds, PATIENCE))
            return found

    def drop(self, *paths: object) -> None:
        """Drop files and folders from another program, with a real protocol."""
        pytest.importorskip("Xlib")
        window = self.screen.do("search", "--name", "Scan4D").split()[-1]
        command = [sys.executable, str(Path(__file__).with_name("drop.py")), window, *map(str, paths)]
        subprocess.run(command, env=self.screen.env, check=True, timeout=PATIENCE)

    def reset(self) -> None:
        """Bring it back to how it was at its start: frame, renderer, camera, pace, theme; at rest."""

        def press_while(keys: str, differs: Callable[[State], bool]) -> None:
            while differs(self.state):
                self.screen.do("key", keys)
                self.settle()

        self.settle()
        first = next(state for state in self.states if state.pictures)
        press_while("space", lambda state: state.is_playing)
        press_while("Escape", lambda state: state.clicking or state.is_export_open or state.shown_notes)
        for keys, field in (("e", "every_frame"), ("l", "loop"), ("shift+space", "reverse")):
            press_while(keys, lambda state: getattr(state, field) != getattr(first, field))  # noqa: B023
        press_while("t", lambda state: state.theme != first.theme)
        press_while("o", lambda state: state.camera["projection"] != first.camera["projection"])
        press_while("b", lambda state: state.backend != first.backend)
        self.screen.do("key", "ctrl+Home", "key", "ctrl+1", "key", "f", "key", "BackSpace", "key", "Escape")
        width, height = first.size
        self.screen.do("mousemove", width - 1, height - 1)
        self.settle()

    def send_notes_away(self) -> None:
        """Press Escape until no message is over the view."""
        while self.settle().shown_notes:
            self.screen.do("key", "Escape")

    def pictures(self, since: int = 0) -> list[State]:
        """The states that drew another picture; since: the number of the one before."""
        drawn = {}
        for state in reversed(self.states):
            if state.pictures <= since:
                break
            drawn[state.pictures] = state
        return [drawn[number] for number in sorted(drawn)]

    def frames(self) -> list[int]:
        """All frames drawn so far, each one once while it stays."""
        return [frame for frame, _ in itertools.groupby(state.frame for state in self.pictures())]

    def view(self) -> tuple[int, int, int, int]:
        """The 3D view on the screen: left, top, width, height."""
        left, top, width, height = self.state.view
        return left, top, width, height

    def cpu_seconds(self) -> float:
        """Processor time that it has taken."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def stored_of(home: Path, scan: object) -> SavedSession:
    """What is kept of a scan for the next start, in the home that `running_app` was given."""
    return SavedSession.load(_kept_path(home, scan))


def _kept_path(home: Path, scan: object) -> Path:
    return home / "config" / "scan4d" / "scans" / stored_file(str(scan)).name


def wait_until(holds: Callable[[], object]) -> None:
    """Wait for what no state of the app says, such as a file."""
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.01)


def wait_until_stored(home: Path, scan: object, state: State) -> None:
    """Wait until what this state shows is kept of a scan for the next start."""

    def is_kept() -> bool:
        if not _kept_path(home, scan).exists():
            return False
        kept: dict[str, Any] = json.loads(json.dumps(stored_of(home, scan).to_json()))
        return kept["document"] == state.document

    wait_until(is_kept)


def slow_pictures(seconds: float) -> str:
    """Python for `running_app`: the window takes at least so long over each picture."""
    return f"exec({_SLOW_PICTURES.format(seconds)!r}); "


@contextmanager
def running_app(
    screen: Screen,
    folder: Path,
    *scans: object,
    before: str = "",
    home: Path | None = None,
    shows: bool = True,
) -> Iterator[RunningApp]:
    """The window on these scans, filling the screen. Screenshots go into the folder.

    before: Python that is run first, to have something fail. home: where settings and unfinished recordings
    are kept; else in the folder. shows: whether a picture comes, which is waited for.
    """
    log, home = folder / "log", home or folder
    reading, writing = os.pipe()
    with log.open("wb") as stream:
        process = subprocess.Popen(
            [
                sys.executable,
                "-c",
                f"{before}import observed; observed.main()",
                str(writing),
                *map(str, scans),
            ],
            cwd=folder,
            env={
                **screen.env,
                "PYTHONPATH": os.pathsep.join((str(ROOT), str(Path(__file__).parent))),
                "XDG_CONFIG_HOME": str(home / "config"),
                "XDG_STATE_HOME": str(home / "state"),
            },
            pass_fds=[writing],
            stdin=subprocess.PIPE,
            stderr=stream,
        )
    os.close(writing)
    app = RunningApp(screen, process, reading, log)
    try:
        app.see()
        window = screen.do("search", "--name", "Scan4D").split()[-1]
        width, height = (int(edge) for edge in screen.do("getdisplaygeometry").split())
        screen.do("windowmove", window, 0, 0, "windowsize", window, width, height)
        app.see(lambda state: state.size == [width, height] and (state.pictures or not shows))
        if shows:
            app.settle()
        yield app
    finally:
        process.kill()
        process.wait()
        if process.stdin is not None:
            process.stdin.close()
