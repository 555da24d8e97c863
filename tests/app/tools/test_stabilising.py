"""Motions are found beside the window, kept, and told in words; paths of landmarks follow them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rigid_hills import RigidHills, opened, truth

from viewer.analysis.motion import partial
from viewer.analysis.motion.axes import anatomical_axes
from viewer.analysis.motion.stabilise import FEW, FrameMotion
from viewer.app.tools.stabilising.choices import FOUND, LANDMARKS, PAINTED, Stabilising
from viewer.app.tools.stabilising.stabiliser import Asked, Motions, motions_folder
from viewer.app.tools.stabilising.words import facts_of, motion_gap_spans
from viewer.errors import InputError
from viewer.rigid import STILL
from viewer.scan.timeline import Timeline
from viewer.scan.units import Scale
from viewer.task import Cancelled, Task

PATCH = Stabilising(region=PAINTED, spheres=((0.0, 0.0, 0.0, 100.0),))
AXES = anatomical_axes("+y")


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def motions(timeline: Timeline, choices: Stabilising = PATCH) -> Motions:
    return Motions(Asked.of(timeline, "mm", choices, {}))


def test_motions_are_kept_and_cancelled_work_goes_on() -> None:
    timeline = opened(RigidHills(5))
    first, task = motions(timeline), Task("test")

    class Stops(dict[int, FrameMotion]):
        def __setitem__(self, frame: int, found: FrameMotion) -> None:
            super().__setitem__(frame, found)
            if len(self) == 3:
                task.cancel()

    first.known = Stops()
    with task.current(), pytest.raises(Cancelled):
        first.find()
    assert len(first.known) == 3
    again = motions(timeline)
    kept = dict(first.known)
    again.find()
    assert again.is_whole
    for frame, found in kept.items():
        motion = again.known[frame].motion
        assert motion is not None
        assert found.motion is not None
        assert (motion.matrix == found.motion.matrix).all(), "what was found is read, not found again"
    assert len(list(motions_folder().glob("*.json"))) == 1
    motions(timeline, Stabilising(reference=1, region=PAINTED, spheres=PATCH.spheres)).find()
    assert len(list(motions_folder().glob("*.json"))) == 2, "of another reference"


def test_a_region_that_scan4d_finds_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    timeline = opened(RigidHills(5, rise=0.6))
    first, again = motions(timeline, Stabilising()), motions(timeline, Stabilising())
    first.find()
    with monkeypatch.context() as patch:
        patch.setattr(partial, "found_region", None)  # it is not looked for again
        again.find()
    assert (again.rows == first.rows).all()
    motion = again.known[4].motion
    assert motion is not None
    assert np.abs(motion.matrix - truth(4, 0).matrix).max() < 0.1


def test_what_cannot_be_found_is_told_once() -> None:
    timeline = opened(RigidHills(2))
    for choices, words in (
        (Stabilising(reference=7), "7"),
        (Stabilising(region=PAINTED), "Choose a larger region"),
        (Stabilising(region=LANDMARKS, landmarks=("gone",), radius=3.0), "no landmark 'gone'"),
    ):
        found = motions(timeline, choices)
        with pytest.raises(InputError, match=words):
            found.find()
        assert words in found.problem


def test_choices_that_motions_do_not_depend_on_find_none_again() -> None:
    timeline = opened(RigidHills(2))
    found = Stabilising(True, 1, FOUND, PATCH.spheres, ("a",), 3.0)
    assert Asked.of(timeline, "mm", found, {}) == Asked.of(timeline, "mm", Stabilising(False, 1), {})
    assert motions(timeline).asked != motions(timeline, Stabilising()).asked


def test_facts_name_the_region_what_it_leaves_open_and_gaps() -> None:
    timeline = opened(RigidHills(3, is_flat=True, lacking=frozenset({1})))
    found = motions(timeline)
    found.find()
    facts = facts_of(found, found.known, AXES, Scale("cm", 0.1))
    assert facts.lines[0] == "The region has 2,500 points, 100% of frame 1."
    assert facts.lines[1].startswith("Distances of the region within ±0.05 cm: 100.0%.")
    weak = [words for words in facts.warnings if "does not determine" in words]
    assert any("left-right axis: ±" in words and words.endswith("cm (in 1 of 3 frames).") for words in weak)
    assert any(
        words.startswith("1 frame is a gap, shown as recorded, such as frame 2") for words in facts.warnings
    )


def test_runs_of_gaps_are_marked_on_the_timeline() -> None:
    gap, there = FrameMotion.gap(FEW), FrameMotion(STILL, np.zeros((6, 6)), within=1.0)
    spans = motion_gap_spans({0: there, 2: gap, 1: gap, 3: FrameMotion.gap("other"), 4: gap})
    assert [one.frames for one in spans] == [range(1, 3), range(3, 4), range(4, 5)]
    assert spans[0].words == f"Not stabilised: {FEW}"
