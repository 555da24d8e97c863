"""Deviations are found beside the window, kept, and found again only where a frame is shown elsewhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rigid_hills import RigidHills, opened, truth

from viewer.analysis.deviation.chosen import ReferenceChoice
from viewer.analysis.deviation.over_time import FramePlace
from viewer.app.tools.deviation import finder
from viewer.app.tools.deviation.choices import FILE, MEAN, Deviating
from viewer.app.tools.deviation.finder import DeviationWork
from viewer.errors import InputError
from viewer.rigid import STILL
from viewer.scan.timeline import Timeline
from viewer.task import Cancelled, Task

FRAMES = 4
RECORDED = {frame: FramePlace(STILL, STILL) for frame in range(FRAMES)}


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


@pytest.fixture
def timeline() -> Timeline:
    return opened(RigidHills(FRAMES))


def work(timeline: Timeline, reference: ReferenceChoice | None = None) -> DeviationWork:
    return DeviationWork(timeline, reference or ReferenceChoice(), (), RECORDED)


def test_cancelled_work_goes_on_and_what_is_kept_is_read(
    timeline: Timeline, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, task = work(timeline), Task("test")

    class Stops(dict):  # type: ignore[type-arg]
        def __setitem__(self, frame: int, found: object) -> None:
            super().__setitem__(frame, found)
            if len(self) == 2:
                task.cancel()

    first.found = Stops()
    with task.current(), pytest.raises(Cancelled):
        first.find()
    assert len(first.found) == 2
    assert not first.is_whole
    again = work(timeline)
    again.find()
    assert again.is_whole
    assert [again.known[frame] for frame in (0, 1)] == list(first.found.values())
    with monkeypatch.context() as patch:
        patch.setattr(finder, "frame_deviation", None)  # nothing is found again
        kept = work(timeline)
        kept.find()
    assert kept.found == again.found


def test_frames_that_move_are_found_again(timeline: Timeline) -> None:
    found = work(timeline)
    found.find()
    recorded = found.known
    moved = truth(3, 0).inverse
    found.places = RECORDED | {3: FramePlace(moved, moved)}
    assert found.left == [3]
    found.find()
    assert found.is_whole
    assert found.known[3].whole.rms < 0.2 * recorded[3].whole.rms, "its motion is removed"
    found.places = RECORDED
    assert not found.left, "both are kept side by side"
    assert found.known == recorded


def test_a_reference_that_cannot_be_read_is_a_problem(timeline: Timeline) -> None:
    found = work(timeline, ReferenceChoice(file="gone.ply"))
    with pytest.raises(InputError):
        found.find()
    assert "gone.ply" in found.problem


def test_choices_name_their_reference() -> None:
    chosen = Deviating(first=2, last=5)
    assert chosen.reference == ReferenceChoice(2, 2)
    assert chosen.changed(kind=MEAN).reference == ReferenceChoice(2, 5)
    assert chosen.changed(kind=FILE).reference is None
    named = chosen.changed(kind=FILE, file="a.ply").reference
    assert named is not None
    assert named.file == "a.ply"
    assert not np.isnan(named.first)
