"""Bookmarks: cameras that a scan keeps by name."""

from __future__ import annotations

import pytest

pytest.importorskip("imgui_bundle")

from viewer.app.notices import Notices
from viewer.app.scene.bookmarks import Bookmarks
from viewer.app.session import Session
from viewer.camera import Camera

CAMERAS = [Camera(eye=(x, 1, 5)) for x in range(3)]


@pytest.fixture
def session() -> Session:
    return Session("one.ply")


@pytest.fixture
def bookmarks(session: Session) -> Bookmarks:
    bookmarks = Bookmarks(session, Notices().tell)
    for camera in CAMERAS:
        session.amend(camera=camera)
        bookmarks.add()
    return bookmarks


def names(bookmarks: Bookmarks) -> list[str]:
    return [bookmark.name for bookmark in bookmarks.all]


def test_they_are_added_under_free_names_renamed_and_deleted(session: Session, bookmarks: Bookmarks) -> None:
    assert names(bookmarks) == ["View 1", "View 2", "View 3"]
    bookmarks.rename(1, "  the left \n eye ")
    bookmarks.rename(0, " ")
    assert names(bookmarks) == ["View 1", "the left eye", "View 3"]
    bookmarks.add()
    assert names(bookmarks)[-1] == "View 2"
    bookmarks.delete(2)
    assert names(bookmarks) == ["View 1", "the left eye", "View 2"]
    assert [bookmark.camera for bookmark in bookmarks.all] == [CAMERAS[0], CAMERAS[1], CAMERAS[2]]
    session.amend(camera=None)
    bookmarks.add()
    assert len(bookmarks.all) == 3, "nothing to keep before there is a picture"


def test_going_from_one_to_the_next_and_back_round_the_end(session: Session, bookmarks: Bookmarks) -> None:
    session.amend(pivot=(1, 2, 3))
    seen = []
    for direction in (1, 1, -1, -1, -1):
        bookmarks.step(direction)
        seen.append(CAMERAS.index(session.document.camera))
    assert seen == [0, 1, 0, 2, 1], "on from the one added last"
    assert session.document.pivot is None
    bookmarks.rename(1, "here")
    bookmarks.step(1)
    assert session.document.camera == CAMERAS[2], "a new name is no other place"
    bookmarks.delete(2)
    bookmarks.step(1)
    assert session.document.camera == CAMERAS[0]
    bookmarks.delete(0)
    bookmarks.step(-1)
    assert session.document.camera == CAMERAS[1]


def test_without_any_there_is_nowhere_to_go(session: Session) -> None:
    session.amend(camera=CAMERAS[1])
    Bookmarks(session, Notices().tell).step(1)
    assert session.document.camera == CAMERAS[1]


def test_each_scan_has_its_own(session: Session, bookmarks: Bookmarks) -> None:
    session.turn_to("two.ply")
    assert bookmarks.all == ()
    session.turn_to("one.ply")
    assert names(bookmarks) == ["View 1", "View 2", "View 3"]


def test_the_menu_ticks_the_one_that_is_shown(session: Session, bookmarks: Bookmarks) -> None:
    assert [is_shown for _, _, is_shown in bookmarks.items()] == [False, False, True]
    _, go, _ = next(bookmarks.items())
    go()
    assert session.document.camera == CAMERAS[0]


def test_what_is_done_with_them_is_undone(session: Session, bookmarks: Bookmarks) -> None:
    bookmarks.step(1)
    bookmarks.rename(0, "front")
    bookmarks.delete(2)
    for name, left in (("Delete", ["front", "View 2"]), ("Rename", ["front", "View 2", "View 3"])):
        assert session.history.undoes == f"{name} bookmark"
        assert names(bookmarks) == left
        session.history.undo()
    assert session.document.camera == CAMERAS[0]
    session.history.undo()
    assert session.document.camera == CAMERAS[2]
    session.history.undo()
    assert names(bookmarks) == ["View 1", "View 2"]
