"""Messages: short notes go by themselves, problems stay until they are sent away."""

from __future__ import annotations

import math
import time

import pytest

pytest.importorskip("imgui_bundle")

from viewer.app.help import has_words, in_columns
from viewer.app.notices import Notices, Offer, Problem


def texts(notices: Notices, now: float) -> list[str]:
    return [notice.text for notice in notices.shown(now)]


def test_notes_go_by_themselves_and_problems_do_not() -> None:
    notices = Notices()
    notices.tell(Problem("it is broken"))
    notices.tell("saved")
    now = time.monotonic()
    assert texts(notices, now) == ["it is broken", "saved"]
    assert 0 < notices.next_change(now) < 10
    later = now + 3600
    assert texts(notices, later) == ["it is broken"]
    assert notices.next_change(later) == math.inf


def test_notes_do_not_push_a_problem_away() -> None:
    notices = Notices()
    notices.tell(Problem("it is broken"))
    for number in range(10):
        notices.tell(f"note {number}")
    assert texts(notices, time.monotonic()) == ["it is broken", "note 7", "note 8", "note 9"]


def test_a_problem_told_again_is_shown_once_and_logged_twice() -> None:
    notices = Notices()
    for _ in range(2):
        notices.tell(Problem("it is broken"))
    assert texts(notices, time.monotonic()) == ["it is broken"]
    assert len(notices.all) == notices.count == 2


def test_problems_are_sent_away_by_their_cross_or_the_latest_by_escape() -> None:
    notices = Notices()
    for text in ("one", "two", "three"):
        notices.tell(Problem(text))
    now = time.monotonic()
    notices.send_away(notices.shown(now)[1])
    assert texts(notices, now) == ["one", "three"]
    assert notices.on_escape()
    assert texts(notices, now) == ["one"]
    assert notices.on_escape()
    assert texts(notices, now) == []
    assert not notices.on_escape()
    assert [notice.text for notice in notices.all] == ["one", "two", "three"]


def test_an_offer_stays_until_another_one_about_the_same() -> None:
    notices = Notices()
    notices.tell(Offer("saved one", {"Film": list}, "recording"))
    notices.tell(Offer("it has changed", {"Reload": list}, "scan"))
    later = time.monotonic() + 3600
    assert texts(notices, later) == ["saved one", "it has changed"]
    notices.tell(Offer("saved two", {"Film": list}, "recording"))
    assert texts(notices, later) == ["it has changed", "saved two"]
    assert len(notices.all) == 3, "all are in the log"


def test_columns_of_the_keys_are_about_as_long_and_keep_their_order() -> None:
    sections = [(str(number), [("does", "key")] * rows) for number, rows in enumerate((5, 12, 2, 25, 15, 6))]
    left, right = in_columns(sections, 2)
    assert left + right == sections
    length = [sum(len(rows) + 1 for _, rows in column) for column in (left, right)]
    assert abs(length[0] - length[1]) <= 25
    assert in_columns(sections, 1) == [sections]


@pytest.mark.parametrize(("words", "is_found"), [
    ([], True), (["frame"], True), (["next", "fra"], True), (["right", "next"], True), (["none"], False),
])  # fmt: skip
def test_searching_goes_by_all_words(words: list[str], is_found: bool) -> None:
    assert has_words(("Playback", "Next frame", "Right"), words) is is_found


def test_what_is_about_a_scan_goes_when_another_one_opens() -> None:
    notices = Notices()
    notices.tell(Problem("frame 3 is broken"), "scan")
    notices.tell(Offer("its files have changed", {"Reload": lambda: None}, "changes"), "scan")
    notices.tell(Problem("Cannot open: other.ply"), "opening")
    notices.tell(Problem("no room on the disk"))
    notices.tell("frame 4 has no normals", "scan")
    now = time.monotonic()
    assert len(texts(notices, now)) == 4
    notices.end("scan")
    assert texts(notices, now) == ["Cannot open: other.ply", "no room on the disk"]
    assert notices.latest == ""
    notices.end("opening")
    assert texts(notices, now) == ["no room on the disk"]
    notices.tell("frame 1 has no normals", "scan")
    assert notices.latest == texts(notices, now)[-1] == "frame 1 has no normals", "of the new one"
    assert len(notices.all) == 6, "all stay in the log"
