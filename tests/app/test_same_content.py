"""Scans that were renamed or copied, and others under the same name: no landmark is lost, none is mixed."""

from __future__ import annotations

import os
from concurrent.futures import Future
from pathlib import Path

import pytest

from viewer.app.files.same_content import offer_of_change, offer_of_stored
from viewer.app.notices import Offer
from viewer.camera import Camera
from viewer.document.document import Bookmark, Document
from viewer.document.recording import fingerprint
from viewer.document.saved_session import SavedSession, store, stored, stored_elsewhere, stored_file
from viewer.scan.open import find_source

HASH, OTHER = "content:0123456789abcdef", "content:fedcba9876543210"
MARKED = Document(bookmarks=(Bookmark("nose", Camera(eye=(0, 0, 2), target=(0, 0, 0))),))


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))


def found(hash: str | None) -> Future[str | None]:
    future: Future[str | None] = Future()
    future.set_result(hash)
    return future


def test_what_is_kept_is_found_by_the_content_of_a_renamed_folder(tmp_path: Path) -> None:
    old, new = tmp_path / "doe", tmp_path / "Doe, Jane"
    old.mkdir()
    for number in range(3):
        (old / f"{number}.xyz").write_text(f"1 2 3\n4 5 {number}\n")
    store(SavedSession(str(old), fingerprint(find_source(old).files), 2, MARKED))
    old.rename(new)
    used: list[SavedSession] = []
    offer = offer_of_stored(str(new), found(fingerprint(find_source(new).files)), used.append)
    assert isinstance(offer, Offer)
    assert f"{old} (bookmarks), which no longer exists" in offer
    ((title, use),) = offer.choices.items()
    assert title == "Use bookmarks of doe"
    use()
    assert [(each.scan, each.pose, each.document) for each in used] == [(str(old), 2, MARKED)]
    assert stored(str(new)) is None, "nothing is used before the user says so"


def test_scans_of_other_content_are_never_offered() -> None:
    store(SavedSession("/scans/a", HASH, 0, MARKED))
    store(SavedSession("/scans/b", None, 0, MARKED))
    store(SavedSession("/scans/c", OTHER, 0, Document()))
    for hash in (OTHER, None):
        assert offer_of_stored("/scans/new", found(hash), list) == ""
    assert offer_of_stored("/scans/a", found(HASH), list) == "", "it is its own"


def test_copies_are_offered_by_what_was_made_last() -> None:
    """The same thing once; a hash that stands in a name alone does not count."""
    store(SavedSession("/scans/a", HASH, 0, MARKED))
    store(SavedSession("/scans/copy", HASH, 1, MARKED))
    store(SavedSession(f"/scans/{HASH}", OTHER, 1, Document(bookmarks=MARKED.bookmarks * 2)))
    store(SavedSession("/scans/b", HASH, 0, Document(bookmarks=MARKED.bookmarks * 3)))
    for age, name in enumerate(("/scans/b", "/scans/copy", "/scans/a")):
        os.utime(stored_file(name), (1e9 - age, 1e9 - age))
    assert [each.scan for each in stored_elsewhere("/new", HASH)] == ["/scans/b", "/scans/copy"]
    offer = offer_of_stored("/new", found(HASH), list)
    assert isinstance(offer, Offer)
    assert list(offer.choices) == ["Use bookmarks of b", "Use bookmarks of copy"]


def test_other_files_under_the_same_name_are_told_and_what_was_made_is_put_aside() -> None:
    saved = SavedSession("/scans/current", HASH, 0, MARKED)
    store(saved)
    assert offer_of_change(saved, found(HASH), list) == offer_of_change(saved, found(None), list) == ""
    began: list[str] = []
    offer = offer_of_change(saved, found(OTHER), lambda: began.append("anew"))
    assert isinstance(offer, Offer)
    assert "may show another subject" in offer
    keeps, begins = offer.choices
    assert (keeps, begins) == ("Keep the bookmarks", "Start without the bookmarks")
    offer.choices[begins]()
    assert began == ["anew"]
    store(SavedSession("/scans/current", OTHER, 0, Document()))  # of the other subject
    offer_of_change(saved, found(OTHER), list)  # once more: nothing is put aside twice
    (aside,) = stored_elsewhere("/scans/current", HASH)
    assert aside == saved, "with the hash of the files that it was made on"
    assert stored_elsewhere("/scans/current", OTHER) == []


def test_without_anything_made_other_files_are_only_told() -> None:
    offer = offer_of_change(SavedSession("/a", HASH, 0, Document()), found(OTHER), list)
    assert offer
    assert not isinstance(offer, Offer)
    assert not stored_file("/a").parent.exists()
