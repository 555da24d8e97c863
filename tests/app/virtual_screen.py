"""A screen in memory with real key and mouse events, and the app running on it."""

from __future__ import annotations

import ctypes
import itertools
import os
import re
import shutil
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 120  # seconds until what does not come about counts as failed

_RUN = """
import logging, sys
logging.basicConfig(format="%(message)s")
logging.getLogger("viewer").setLevel(logging.DEBUG)
from viewer.app import run
sys.exit(run(sys.argv[1:]))
"""


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


class RunningApp:
    """The app as a process of its own."""

    def __init__(self, screen: Screen, process: subprocess.Popen[bytes], log: Path) -> None:
        self.screen, self.process = screen, process
        self._log = log
        self._read = 0

    def log(self) -> str:
        """All that it has reported so far."""
        return self._log.read_text(errors="replace")

    def expect(self, pattern: str) -> re.Match[str]:
        """Wait until a line that was not expected before matches; fails when the app ends."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            running = self.process.poll() is None
            if found := re.compile(pattern).search(self.log(), self._read):
                self._read = found.end()
                return found
            assert running, f"the app has ended:\n{self.log()}"
            time.sleep(0.02)
        raise AssertionError(f"no '{pattern}' in:\n{self.log()[self._read :]}")

    def frames(self) -> list[int]:
        """All frames drawn so far, each one once while it stays."""
        drawn = re.findall(r"drew frame (\d+) ", self.log())
        return [int(frame) for frame, _ in itertools.groupby(drawn)]

    def settle(self, seconds: float = 0.4) -> None:
        """Wait until it has drawn nothing for so long."""
        drawn = -1
        while (now := self.log().count("drawn")) != drawn:
            drawn = now
            time.sleep(seconds)

    def view(self) -> tuple[int, int, int, int]:
        """The 3D view on the screen: left, top, width, height."""
        left, top, width, height = re.findall(r"view at (\d+),(\d+) (\d+)x(\d+)", self.log())[-1]
        return int(left), int(top), int(width), int(height)

    def cpu_seconds(self) -> float:
        """Processor time that it has taken."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@contextmanager
def running_app(
    screen: Screen, folder: Path, *scans: object, before: str = "", home: Path | None = None
) -> Iterator[RunningApp]:
    """The window on these scans, filling the screen. Screenshots go into the folder.

    before: Python that is run first, to have something fail. home: where settings and unfinished recordings
    are kept; else in the folder.
    """
    log, home = folder / "log", home or folder
    with log.open("wb") as stream:
        process = subprocess.Popen(
            [sys.executable, "-c", before + _RUN, *map(str, scans)],
            cwd=folder,
            env={
                **screen.env,
                "PYTHONPATH": str(ROOT),
                "XDG_CONFIG_HOME": str(home / "config"),
                "XDG_STATE_HOME": str(home / "state"),
            },
            stderr=stream,
        )
    app = RunningApp(screen, process, log)
    try:
        app.expect("window drawn")
        window = screen.do("search", "--name", "Scan4D").split()[-1]
        width, height = screen.do("getdisplaygeometry").split()
        is_full = {f"WIDTH={width}", f"HEIGHT={height}"} <= set(
            screen.do("getwindowgeometry", "--shell", window).split()
        )
        screen.do("windowmove", window, 0, 0, "windowsize", window, width, height)
        if not is_full:
            app.expect("view at")
        if not (is_full and app.frames()):
            app.expect("drew frame .*")
        app.settle()
        yield app
    finally:
        process.kill()
        process.wait()
