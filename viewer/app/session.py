"""What the window shows: the document of the open scan with its history, the frame, and how it plays."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from ..camera import Camera
from ..document.document import Bookmark, Document
from ..document.history import History
from ..document.part import Part
from ..files import absolute
from ..scan.open import DEMO
from .playing.player import Pace


@dataclass(frozen=True)
class Left:
    """How a scan was left: what of it comes back."""

    index: int = 0
    camera: Camera | None = None
    unit: str | None = None
    bookmarks: tuple[Bookmark, ...] = ()


def known_as(scan: str) -> str:
    """The name that a scan is remembered by: its path from the root, wherever Scan4D was started."""
    return scan if scan == DEMO else absolute(scan)


class Session:
    """The open scan, and those that were open.

    scan: as the user named it. index: the frame. history: of the scan's document. pace: how the scan plays.
    places: scan, as `known_as` has it -> how it was left; the one left last at the end.
    """

    def __init__(
        self,
        scan: str,
        document: Document | None = None,
        pace: Pace | None = None,
        places: Mapping[str, Left] | None = None,
    ) -> None:
        """document: to begin with, where the scan is in none of the places."""
        self.scan = scan
        self.index = 0
        self.history = History(document or Document())
        self.pace = pace or Pace()
        self.places = dict(places or {})
        self._histories: dict[str, History] = {}
        self._find_again()

    @property
    def document(self) -> Document:
        """The document of the open scan, as it is now."""
        return self.history.document

    def change(self, name: str, *parts: Part, merge: Hashable = None, **fields: Any) -> None:
        """Change the document: some fields, and what tools keep. name, merge: as for `History.change`."""
        changed = replace(self.document, **fields)
        for part in parts:
            changed = changed.with_part(part)
        self.history.change(name, changed, merge)

    def amend(self, **fields: Any) -> None:
        """Set fields of the document that no user changed."""
        self.history.amend(replace(self.document, **fields))

    def turn_to(self, scan: str) -> None:
        """Go to another scan, where it was left; what can be undone of it stays."""
        self.leave()
        self._histories[known_as(self.scan)] = self.history
        self.scan, self.index = scan, 0
        self.history = self._histories.get(known_as(scan)) or History(self.document.for_another())
        self._find_again()

    def leave(self) -> None:
        """Note how the scan is now, as the one left last."""
        name, now = known_as(self.scan), self.document
        self.places.pop(name, None)
        self.places[name] = Left(self.index, now.camera, now.unit, now.bookmarks)

    def _find_again(self) -> None:
        """Take up the scan as it was left."""
        if (left := self.places.get(known_as(self.scan))) is not None:
            self.index = left.index
            self.amend(camera=left.camera, unit=left.unit, bookmarks=left.bookmarks)


def edit_name(before: Any, after: Any) -> str:
    """What to call a change of some parameters: "Change colour map"; of several "Change parameters"."""
    changed = [name for name in vars(after) if getattr(after, name) != getattr(before, name)]
    words = changed[0].replace("_", " ").replace("color", "colour") if len(changed) == 1 else "parameters"
    return f"Change {words}"
