"""Files that change on disk are told once, when they are whole; nothing is told of what stays."""

from __future__ import annotations

import os
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("imgui_bundle")

from viewer.app.files.changes import EVERY, Changes
from viewer.app.notices import Offer
from viewer.app.playing.timeline_bar import beside, tick_step
from viewer.app.session import Session


class Watch:
    """Changes of files by a clock of its own. told: what they offer. opened: the scans that they open."""

    def __init__(self, files: list[Path], scan: object = "scan") -> None:
        self.told: list[str] = []
        self.opened: list[str] = []
        self.changes = Changes(Session(str(scan)), self.told.append, self.opened.append)
        self.changes.begin_scan(SimpleNamespace(files=files))
        self.now = 0.0
        self.look()

    def look(self) -> None:
        """The next look, to its end."""
        self.now += EVERY + 1
        self.changes.advance(self.now)
        while self.changes._look is not None:
            time.sleep(0.001)
            self.changes.advance(self.now)


def test_a_file_that_changes_is_offered_once_it_rests(tmp_path: Path) -> None:
    files = [tmp_path / f"{number}.npy" for number in range(3)]
    for file in files:
        np.save(file, np.zeros((5, 3)))
    watch = Watch(files)
    watch.look()
    assert watch.told == []
    for number in range(3):  # it is being written
        np.save(files[1], np.zeros((6 + number, 3)))
        watch.look()
        assert watch.told == []
    watch.look()
    watch.look()
    (told,) = watch.told
    assert isinstance(told, Offer)
    told.choices["Reload"]()
    assert watch.opened == ["scan"]


def test_what_is_gone_is_not_offered_before_it_is_back(tmp_path: Path) -> None:
    file = tmp_path / "a.npy"
    np.save(file, np.zeros((5, 3)))
    watch = Watch([file])
    os.rename(file, tmp_path / "b.npy")
    for _ in range(3):
        watch.look()
    assert watch.told == []
    np.save(file, np.zeros((7, 3)))
    for _ in range(2):
        watch.look()
    assert len(watch.told) == 1


@pytest.mark.parametrize("name", ["", "*.npy"])
def test_files_that_come_to_a_sequence_are_offered_and_others_are_not(tmp_path: Path, name: str) -> None:
    files = [tmp_path / f"{number}.npy" for number in range(3)]
    for file in files:
        np.save(file, np.zeros((5, 3)))
    watch = Watch(files, tmp_path / name if name else tmp_path)
    watch.look()
    (tmp_path / "notes.md").write_text("none")
    for _ in range(3):
        watch.look()
    assert watch.told == []
    for number in (3, 4):
        np.save(tmp_path / f"{number}.npy", np.zeros((5, 3)))
    for _ in range(4):
        watch.look()
    assert watch.told == ["The scan has 2 new files on disk."]


def test_a_file_beside_a_scan_of_one_file_is_not_of_it(tmp_path: Path) -> None:
    for name in ("a.npy", "b.npy"):
        np.save(tmp_path / name, np.zeros((5, 3)))
        if name == "a.npy":
            watch = Watch([tmp_path / name], tmp_path / name)
    for _ in range(3):
        watch.look()
    assert watch.told == []


def test_numbers_of_ticks_stand_beside_handles() -> None:
    handles = [(-5, 5), (195, 205)]
    assert beside(50, 30, handles, 0, 200) == 50
    assert beside(-15, 30, handles, 0, 200) == 5
    assert beside(185, 30, handles, 0, 200) == 165
    assert beside(100, 30, [(90, 112)], 0, 200) == 112
    assert beside(3, 30, [(0, 200)], 0, 200) == 3, "there is no room but there"


@pytest.mark.parametrize(
    ("duration", "most", "step"),
    [(2.56, 10, 0.5), (2.56, 3, 1), (10, 10, 1), (0.0101, 10, 0.002), (7200, 9, 1000), (1, 0, 1)],
)
def test_ticks_are_round_and_have_room(duration: float, most: float, step: float) -> None:
    assert tick_step(duration, most) == pytest.approx(step)
    assert duration / tick_step(duration, most) <= max(most, 1)
