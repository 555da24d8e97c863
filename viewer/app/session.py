"""What the window shows: the document of the open scan with its history, the frame, and how it plays."""

from __future__ import annotations

import os
import re
from collections.abc import Hashable, Mapping
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import asdict, dataclass, field, is_dataclass, replace
from itertools import chain, count
from pathlib import Path
from typing import Annotated, Any

from ..backends import backend
from ..document.document import Document, KeptGoal
from ..document.history import History
from ..document.part import Part
from ..document.saved_session import SavedSession, known_as
from ..document.schema import BackendName, ReadBy, is_object, usable
from ..errors import InputError
from ..geometry import UP
from ..look import Look
from .laid import Laid
from .part import WindowPart, chosen
from .playing.player import Pace

_MOST_LEFT = 50  # scans whose changes can still be undone


def named_like(scan: str, folder: Path, suffix: str) -> Path:
    """A file in a folder that is named like a scan and is not there yet: "face.scan4d.json", then
    "face_2.scan4d.json"."""
    path = Path(known_as(scan))
    name = path.name if os.path.isdir(path) else path.stem
    stem = re.sub(r"%0?[0-9]*d|[^\w .-]+", "_", name).strip(" ._-")
    paths = (folder / f"{stem or 'scan'}{more}{suffix}" for more in chain([""], map("_{}".format, count(2))))
    return next(path for path in paths if not os.path.exists(path))


def _read_params(data: Any) -> dict[str, Any]:
    """Parameters by name of backends; those of backends that are not there are left out."""
    found = {}
    for name, values in data.items() if is_object(data) else ():
        with suppress(InputError):
            found[name] = usable(backend(name).params(), values)
    return found


@dataclass(frozen=True)
class SessionSettings:
    """How a scan begins that was never open.

    backend, params, goal: what the user chose for all scans. look, pace: those of the last scan.
    """

    backend: BackendName | None = None
    params: Annotated[Mapping[str, Any], ReadBy(_read_params)] = field(default_factory=dict)
    goal: KeptGoal = None
    look: Look = field(default_factory=Look)
    pace: Pace = field(default_factory=Pace)

    @property
    def document(self) -> Document:
        """The document of such a scan."""
        return Document(look=self.look.of_any_scan, backend=self.backend, params=self.params, goal=self.goal)


class Session(WindowPart):
    """The open scan, and those that were open.

    scan: as the user named it. index: the frame. history: of the scan's document. laid: what tools lay over
    its poses. pace: how the scan plays. for_all: holds the renderer that the user chose for all scans, with
    which those begin that were never open; without one, each begins with its own default.
    hash_found: brings the scan's hash (see `fingerprint`), None where it has no files.
    """

    name = "session"
    Settings = SessionSettings

    def __init__(
        self,
        scan: str,
        document: Document | None = None,
        pace: Pace | None = None,
        left: SavedSession | None = None,
    ) -> None:
        """left: how the scan was left; None: it begins with the document."""
        self.scan = scan
        self.index = 0 if left is None else left.pose
        self.history = History(left.document if left else document or Document())
        self.for_all = (document or Document()).renderer_alone
        self.laid = Laid()
        self.pace = pace or Pace()
        self.hash_found: Future[str | None] = Future()
        self._left: dict[
            str, tuple[History, int]
        ] = {}  # by scan, as `known_as` has it; the last one left last

    def remembered(self) -> dict[str, Any]:
        """The values that come back at the next start. Parameters that are the defaults are not written,
        since a later version may change those."""
        params = {name: chosen(of) for name, of in self.for_all.params.items() if is_dataclass(of)}
        return {
            "backend": self.for_all.backend, "params": params,
            "goal": None if self.for_all.goal is None else asdict(self.for_all.goal),
            "look": chosen(self.document.look.of_any_scan), "pace": asdict(self.pace),
        }  # fmt: skip

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

    @property
    def hash(self) -> str | None:
        """The scan's hash, which tells whether it is still the same; None until it was found."""
        return self.hash_found.result() if self.hash_found.done() else None

    def saved(self, index: int) -> SavedSession:
        """The session of the open scan that is to come back. index: the frame to begin with."""
        return SavedSession(known_as(self.scan), self.hash, index, self.document)

    def left(self, scan: str) -> SavedSession | None:
        """The session of a scan that was open before, as it was left; None where it was not."""
        history, index = self._left.get(known_as(scan), (None, 0))
        return None if history is None else SavedSession(known_as(scan), None, index, history.document)

    def turn_to(self, scan: str, left: SavedSession | None = None, up: str | None = None) -> None:
        """Go to another scan, as it was left; what can be undone of one that was open stays.

        left: None where it was never open: it begins in this one's look, by its own default renderer or the
        one `for_all`. up: its up axis then, where the user tells one.
        """
        begun = History(self.document.for_another(self.for_all, up or UP) if left is None else left.document)
        self._left[known_as(self.scan)] = self.history, self.index
        beginning = begun, 0 if left is None else left.pose
        self.history, self.index = self._left.pop(known_as(scan), beginning)
        self.scan = scan
        self.laid.clear()
        for oldest in list(self._left)[:-_MOST_LEFT]:
            del self._left[oldest]

    def take_up(self, session: SavedSession) -> None:
        """Take up the document of a session of the open scan; undo brings back how it was."""
        self.history.change("Open session", session.document)


def edit_name(before: Any, after: Any) -> str:
    """Name a change of some parameters: "Change colour map"; of several "Change parameters"."""
    changed = [name for name in vars(after) if getattr(after, name) != getattr(before, name)]
    words = changed[0].replace("_", " ").replace("color", "colour") if len(changed) == 1 else "parameters"
    return f"Change {words}"
