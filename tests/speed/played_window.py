"""The window on a scan that plays: how scripts of this folder that measure it begin."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "app"))
from virtual_screen import RunningApp, State, running_app, virtual_screen

from viewer.app.playing.player import Player
from viewer.scan.open import open_scan


def arguments_of(description: str | None) -> argparse.ArgumentParser:
    """What all of them are told: the window's size, and a scan."""
    arguments = argparse.ArgumentParser(description=(description or "").partition("\n")[0])
    arguments.add_argument("--size", default="1280x720")
    arguments.add_argument("scan", nargs="?", default="demo")
    return arguments


@contextmanager
def window_on(options: argparse.Namespace) -> Iterator[tuple[RunningApp, Player]]:
    """The window at rest, and the timing of its scan. options: as `arguments_of` parses them."""
    width, height = (int(n) for n in options.size.split("x"))
    with open_scan(options.scan) as timeline:
        player = Player(timeline.times)
    with tempfile.TemporaryDirectory() as name:
        folders = [Path(name, part) for part in ("screen", "app")]
        for folder in folders:
            folder.mkdir()
        with (
            virtual_screen(folders[0], (width, height)) as screen,
            running_app(screen, folders[1], options.scan) as app,
        ):
            yield app, player


def switch_to(app: RunningApp, backend: str) -> State:
    """Draw with this backend; returns the state at rest."""
    while (state := app.settle()).backend != backend:
        app.screen.do("key", "b")
    return state
