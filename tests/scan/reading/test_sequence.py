"""Decisions that the frames of a scan share, and how readers get them."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np

from viewer.scan.reading.corrections import Corrections
from viewer.scan.reading.record import Aside, Decision
from viewer.scan.reading.sequence import Decided, ask


def test_a_settled_decision_is_made_once_for_all_frames_and_threads() -> None:
    decided, made = Decided(), []

    def decide() -> Decision:
        made.append(threading.get_ident())
        return Decision("colors", 255)

    threads = [threading.Thread(target=lambda i=i: decided.at(i).settle("colors", decide)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(made) == 1
    assert decided.settle("colors", lambda: Decision("colors", 1)).value == 255
    assert decided.reading["colors"].value == 255


def test_the_first_note_of_a_key_stays_until_it_is_replaced() -> None:
    decided = Decided()
    decided.note(Decision("format", "PLY"))
    decided.at(3).note(Decision("format", "PCD"))
    assert decided.reading["format"].value == "PLY"
    decided.replace(Decision("format", "PCD"))
    assert decided.reading["format"].value == "PCD"


def test_a_contradiction_is_recorded_and_reported_once_a_frame() -> None:
    decided = Decided()
    for frame in (2, 2, 5):
        decided.at(frame).contradict("colors", f"colors of frame {frame + 1} go up to 65535")
    assert [one.frame for one in decided.reading.contradictions] == [2, 5]
    reports = decided.reports()
    assert [(one.kind, one.frame) for one in reports] == [("contradiction", 2), ("contradiction", 5)]
    assert decided.reports(1) == reports[1:]


def test_what_is_left_aside_or_unused_is_recorded_once() -> None:
    decided = Decided()
    for _ in range(2):
        decided.leave_aside(Aside("a.ply", "copy of b.ply"))
        decided.note_unused("45 harmonics")
    assert decided.reading.aside == (Aside("a.ply", "copy of b.ply"),)
    assert decided.reading.unused == ("45 harmonics",)


def test_corrections_that_no_decision_uses_are_known() -> None:
    decided = Decided(Corrections.parse({"decimal": ",", "unit": "mm"}))
    decided.note(Decision("unit", "mm", "user"), Decision("decimal", ".", "file"))
    assert decided.ignored() == ["decimal"]


def test_hooks_of_readers_get_the_decisions_where_they_ask_for_them() -> None:
    decided = Decided()
    assert ask(lambda path: path, Path("a"), decided=decided) == Path("a")
    assert ask(lambda path, decided: decided, Path("a"), decided=decided) is decided


def test_frames_of_a_sequence_can_be_sampled(tmp_path: Path) -> None:
    """Only formats that return contents give samples; others give none."""
    from viewer.scan.open import find_source

    for index in range(3):
        np.save(tmp_path / f"f{index}.npy", np.zeros((4, 3), np.float32))
    source = find_source(tmp_path)
    assert all(contents.columns or contents.arrays for contents in source.decided.samples())  # type: ignore[attr-defined]
