"""Sessions as files: a document, and the scan that it belongs to.

    {"format": 1, "version": "0.1.0", "scan": "scans/knot", "hash": "files:0123456789abcdef", "pose": 3,
     "document": {"camera": {...}, "look": {...}, "backend": "points", "params": {"points": {...}}, ...}}

Whoever saves a session names the file; its scan is named from the folder of the file. The documents of all
scans that were open are kept in the same form in the user's folder, a file a scan, named by a hash of the
scan's path.
"""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from .. import __version__
from ..errors import InputError
from ..files import absolute, whole_file
from ..folders import user_folder
from ..scan.open import DEMO
from .document import Document
from .schema import DAMAGED, Hash, PoseNumber, ScanName, is_object, migrated, plain, read_json, structured

FORMAT = 1
SUFFIX = ".scan4d.json"
MOST_KEPT = 200  # documents in the user's folder; those written last


@dataclass(frozen=True)
class SavedSession:
    """A document and its scan. scan: its path, from the root or from the folder of the file, or "demo".

    hash: of its files (see `fingerprint`), None where there is none or it is not known yet. pose: the frame
    that is shown.
    """

    scan: ScanName
    hash: Hash | None
    pose: PoseNumber
    document: Document

    def to_json(self) -> dict[str, Any]:
        """A JSON object."""
        return {"format": FORMAT, "version": __version__} | plain(self)

    @classmethod
    def from_json(cls, data: Any, where: object) -> SavedSession:
        """The session of a JSON object. Raises InputError for whatever is wrong in it."""
        if not is_object(data) or "document" not in data:
            raise InputError("is no session", where, DAMAGED)
        current = migrated(data, FORMAT, {}, where)
        fields = {name: value for name, value in current.items() if name not in ("format", "version")}
        return structured(cls, fields, where)

    def save(self, path: Path) -> None:
        """Write the file, and its folder. Raises InputError where it cannot be written."""
        text = json.dumps(self.to_json(), indent=1)
        with whole_file(path) as temporary:
            path.parent.mkdir(parents=True, exist_ok=True)
            temporary.write_text(text + "\n", encoding="utf-8")

    def export(self, path: Path) -> None:
        """Write the file with the scan named from its folder, so that both can be moved together."""
        replace(self, scan=_named_from(path.parent, self.scan)).save(path)

    @classmethod
    def load(cls, path: Path) -> SavedSession:
        """Read a file. Raises InputError, which names it, for whatever is wrong in it."""
        return cls.from_json(read_json(path), path)


def is_session(path: Path) -> bool:
    """Whether a file is a session, by the end of its name."""
    return path.name.lower().endswith(SUFFIX)


def _named_from(folder: Path, scan: str) -> str:
    """A scan's path from a folder, with slashes; from the root where it is on another drive."""
    if scan == DEMO:
        return scan
    try:
        return Path(os.path.relpath(absolute(scan), absolute(folder))).as_posix()
    except ValueError:
        return absolute(scan)


# --- those of all scans -----------------------------------------------------------------------


def kept_file(scan: str) -> Path:
    """File of a scan's document. scan: its path from the root, or "demo"."""
    digest = hashlib.sha256(os.fsencode(scan)).hexdigest()[:32]
    return user_folder() / "scans" / f"{digest}.json"


def keep(session: SavedSession) -> None:
    """Keep the document of a scan, which is named from the root; older ones beyond MOST_KEPT go.

    Raises InputError where it cannot be written.
    """
    path = kept_file(session.scan)
    is_new = not os.path.exists(path)
    session.save(path)
    if is_new:
        _delete_oldest(path.parent)


def kept(scan: str) -> SavedSession | None:
    """Read what is kept of a scan; None where there is nothing. scan: its path from the root, or "demo".

    Raises InputError where that is damaged: it is put aside.
    """
    path = kept_file(scan)
    if not os.path.lexists(path):
        return None
    try:
        return SavedSession.load(path)
    except InputError as error:
        aside = path.with_suffix(".old.json")
        with suppress(OSError):
            os.replace(path, aside)
        what = f"what was kept of it cannot be read ({error.what})"
        raise InputError(what, scan, f"It is put aside as {aside}; the scan opens anew") from error


def _delete_oldest(folder: Path) -> None:
    def age(path: Path) -> float:
        with suppress(OSError):
            return -os.stat(path).st_mtime
        return 0.0

    with suppress(OSError):
        for path in sorted(folder.glob("*.json"), key=age)[MOST_KEPT:]:
            path.unlink(missing_ok=True)
