"""What is kept of a scan, and its files: the same ones under another name, or others under the same name."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from pathlib import Path

from ...document.saved_session import SavedSession, set_aside, stored_elsewhere
from ...errors import InputError
from ...files import printable
from ..notices import Offer

_ABOUT = "kept"  # what these offers are about: one replaces the other


def offer_of_stored(scan: str, hash: Future[str | None], use: Callable[[SavedSession], object]) -> str:
    """An offer to use what is kept of the same files under another name; empty where nothing is.

    Waits for the hash. scan: its path from the root, or "demo". use: takes what the user chooses.
    """
    found = stored_elsewhere(scan, found_hash) if (found_hash := hash.result()) else []
    if not found:
        return ""
    named = [f"{printable(each.scan)} ({_made(each)})" for each in found]
    gone = "" if os.path.lexists(found[0].scan) else ", which no longer exists"
    choices = {f"Use {_made(each)} of {_title(each.scan)}": partial(use, each) for each in found[::-1]}
    text = f"Scan4D has seen the files of this scan under another name: {'; '.join(named)}{gone}."
    return Offer(text, dict(reversed(choices.items())), _ABOUT)


def offer_of_change(saved: SavedSession, hash: Future[str | None], begin: Callable[[], object]) -> str:
    """Words on a scan whose files are others than those that its document was made on; else empty.

    Waits for the hash. Where the user has made something, that is put aside as it was, and the words are an
    offer to begin without it. begin: does that.
    """
    if hash.result() in (saved.hash, None):
        return ""
    text = (
        "The files of the scan have changed since Scan4D saved your work. Bookmarks and distances may no "
        "longer fit the scan."
    )
    if not saved.document.made:
        return text
    with suppress(InputError):  # what is kept stays as it is, and a message says so when it is written
        set_aside(saved)
    kept = _made(saved)
    choices = {f"Keep the {kept}": lambda: None, f"Start without the {kept}": begin}
    return Offer(f"{text} The files may show another subject.", choices, _ABOUT)


def _made(session: SavedSession) -> str:
    """Names of what a user has made: "landmarks, bookmarks"."""
    document = session.document
    names = [*sorted(document.parts), *(["bookmarks"] if document.bookmarks else [])]
    return ", ".join(names) or "notes"


def _title(scan: str) -> str:
    return printable(Path(scan).name) or scan
