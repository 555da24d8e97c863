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
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from itertools import count
from pathlib import Path
from typing import Annotated, Any

from .. import __version__
from ..errors import InputError, explained
from ..files import absolute, open_plain, output_folder, whole_file
from ..folders import new_file, user_folder
from ..scan.open import STANDARD_INPUT, is_no_path
from .document import Document
from .schema import (
    DAMAGED,
    Hash,
    NewerFormatError,
    PoseNumber,
    ReadBy,
    ScanName,
    check_format,
    is_object,
    plain,
    read_json,
    structured,
    unread,
)

FORMAT = 1
SUFFIX = ".scan4d.json"
MOST_STORED = 200  # documents in the user's folder beyond which those go that hold nothing a user made
_seen: dict[
    Path, tuple[bytes, object]
] = {}  # file -> what this process read or wrote last: digest, what was made


@dataclass(frozen=True)
class SavedSession:
    """A document and its scan. scan: its path, from the root or from the folder of the file, or "demo".

    hash: of its files (see `fingerprint`), None where there is none or it is not known yet. pose: the frame
    that is shown.
    """

    scan: ScanName
    hash: Hash | None
    pose: PoseNumber
    document: Annotated[Document, ReadBy(Document.from_json)]

    def to_json(self) -> dict[str, Any]:
        """A JSON object."""
        return {"format": FORMAT, "version": __version__} | plain(self)

    @classmethod
    def from_json(cls, data: Any, where: object) -> SavedSession:
        """The session of a JSON object; what cannot be read of its document stays unread in that, so do
        fields that are not known here, under names such as "session.notes".

        Raises InputError where something else is wrong.
        """
        if not is_object(data) or "document" not in data:
            raise InputError("is not a session", where, DAMAGED)
        check_format(data, FORMAT, where)
        known = {field.name for field in fields(cls)}
        session = structured(cls, {name: data[name] for name in known & data.keys()}, where)
        others = data.keys() - known - {"format", "version"}
        left = {f"session.{name}": unread(data[name]) for name in sorted(others)}
        return session._with_unread(left) if left else session

    def _with_unread(self, left: dict[str, Any]) -> SavedSession:
        document = replace(self.document, unread={**self.document.unread, **left})
        return replace(self, document=document)

    @property
    def problem(self) -> str | None:
        """The note for the user about a session that was read; None where nothing is unreadable."""
        if not (names := ", ".join(self.document.unreadable)):
            return None
        what = f"Scan4D cannot read some of your saved work on this scan: {names}"
        return str(
            InputError(
                what, self.scan, ("This work stays in the file, for a version of Scan4D that can read it")
            )
        )

    def save(self, path: Path) -> None:
        """Write the file. Raises InputError where it cannot be written."""
        with whole_file(path) as temporary:
            temporary.write_bytes(self._text)

    @property
    def _text(self) -> bytes:
        return (json.dumps(self.to_json(), indent=1) + "\n").encode()

    def export(self, path: Path) -> None:
        """Write the file with the scan named from its folder, so that both can be moved together.

        The folder is made where it is missing.
        """
        output_folder(path.parent)
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
    if is_no_path(scan):
        return scan
    try:
        return Path(os.path.relpath(absolute(scan), absolute(folder))).as_posix()
    except ValueError:
        return absolute(scan)


# --- those of all scans -----------------------------------------------------------------------


def known_as(scan: str) -> str:
    """The name that a scan is remembered by: its path from the root, wherever Scan4D was started."""
    return scan if is_no_path(scan) else absolute(scan)


def stored_file(scan: str) -> Path:
    """File of a scan's document. scan: its path from the root, or "demo"."""
    digest = hashlib.sha256(os.fsencode(scan)).hexdigest()[:32]
    return user_folder() / "scans" / f"{digest}.json"


def store(session: SavedSession) -> str | None:
    """Keep the document of a scan, which is named from the root; older ones beyond MOST_STORED go in which
    nothing was made (see `Document.made`).

    Where another window has written it meanwhile, what was made there is put aside; returns words of that for
    the user. Raises InputError where it cannot be written, or there is one that only others can read.
    """
    if session.scan == STANDARD_INPUT:
        return None  # the next stream is another scan
    path = stored_file(session.scan)
    is_new = not os.path.lexists(path)
    aside = None if is_new else _spared(path, session.document)
    try:
        session.save(path)
    except InputError:
        if aside is not None:
            with suppress(OSError):
                os.replace(aside, path)
        raise
    _seen[path] = _digest(session._text), session.document.made
    if is_new:
        _delete_oldest(path.parent)
    if aside is None:
        return None
    what = "another program, perhaps a second window of Scan4D, has saved work on this scan"
    return str(
        InputError(
            what, session.scan, (f"Scan4D moved that work to {aside}. To see that work, open this file")
        )
    )


def stored(scan: str) -> SavedSession | None:
    """Read what is kept of a scan; None where there is nothing. scan: its path from the root, or "demo".

    Raises InputError where that cannot be read: it is put aside where it is damaged, and stays as it is where
    it was written by a later Scan4D or the system refuses.
    """
    path = stored_file(scan)
    if not os.path.lexists(path):
        return None
    try:
        digest = _digest_of_file(path)  # before it is read: a message reports what changes meanwhile
        session = SavedSession.load(path)
        _seen[path] = digest, session.document.made
        return session
    except InputError as error:
        what = f"Scan4D cannot read your saved work on this scan ({error.what})"
        if _is_foreign(error):
            hint = f"The work stays in {path}. Scan4D opens the scan without this work, and saves no new work"
            raise InputError(what, scan, hint) from error
        aside = _put_aside(path)
        raise InputError(
            what,
            scan,
            (f"Scan4D renamed the file with this work to {aside}, and opens the scan without it"),
        ) from error


def stored_elsewhere(scan: str, hash: str) -> list[SavedSession]:
    """Kept sessions of other scans with this hash, or put aside, that hold what a user has made: the last
    written first, of equal ones that alone. What cannot be read is left out.

    scan: its path from the root; what is kept of this itself does not count.
    """
    folder, own = stored_file(scan).parent, stored_file(scan)
    found: list[SavedSession] = []
    for path in sorted((path for path in folder.glob("*.json") if path != own), key=_age):
        with suppress(InputError, OSError):
            if hash.encode() in path.read_bytes():  # before all of it is parsed
                session = SavedSession.load(path)
                made = [other.document.made for other in found]
                if session.hash == hash and session.document.made and session.document.made not in made:
                    found.append(session)
    return found


def set_aside(session: SavedSession) -> None:
    """Keep a copy of a session as it is, where `stored_elsewhere` finds it; what was made in it once alone.

    Raises InputError where it cannot be written.
    """
    path = stored_file(session.scan)
    if session.document.made not in _made_aside(path):
        session.save(_free_aside(path))


def _is_foreign(error: InputError) -> bool:
    """Whether a file cannot be read here, and may well be whole."""
    return isinstance(error, NewerFormatError) or isinstance(error.__cause__, OSError)


def _digest(text: bytes) -> bytes:
    return hashlib.sha256(text).digest()


def _digest_of_file(path: Path) -> bytes:
    """Digest of a file; empty where it cannot be read."""
    with suppress(OSError), open_plain(path) as stream:
        return _digest(stream.read())
    return b""


def _spared(path: Path, document: Document) -> Path | None:
    """Put a file that is to be written over aside, where it would take with it what was made in another
    window; returns where to. Raises InputError where only others can read it."""
    digest, made = _seen.get(path, (None, ()))
    if _digest_of_file(path) == digest:
        return None
    try:
        others = SavedSession.load(path).document.made
        if others in ((), made, document.made) or others in _made_aside(path):
            return None
    except InputError as error:
        if _is_foreign(error):
            raise
    return _put_aside(path)


def _made_aside(path: Path) -> Iterator[object]:
    """Things that were made in the documents put aside of a scan."""
    for aside in path.parent.glob(f"{path.stem}.old-*{SUFFIX}"):
        with suppress(InputError):
            yield SavedSession.load(aside).document.made


def _put_aside(path: Path) -> Path:
    """Give a file another name, which is free. Raises InputError where the system refuses."""
    aside = _free_aside(path)
    try:
        os.replace(path, aside)
    except OSError as error:
        what, hint = explained(error)
        raise InputError(f"cannot be renamed: {what}", path, hint) from error
    return aside


def _free_aside(path: Path) -> Path:
    """A new file beside one that is kept, empty until that or another one replaces it.

    Raises InputError where the system refuses.
    """
    for number in count(1):
        aside = path.with_name(f"{path.stem}.old-{number}{SUFFIX}")
        try:
            os.close(new_file(aside))
            return aside
        except FileExistsError:
            continue
        except OSError as error:
            what, hint = explained(error)
            raise InputError(f"cannot be renamed: {what}", path, hint) from error
    raise AssertionError("an unused file name always exists")


def _delete_oldest(folder: Path) -> None:
    """Delete documents beyond MOST_STORED, those written first, in which a user has made nothing."""

    stored_files = [path for path in folder.glob("*.json") if _is_stored_file(path)]
    for path in sorted(stored_files, key=_age)[MOST_STORED:]:
        with suppress(InputError, OSError):  # what cannot be read stays
            if not SavedSession.load(path).document.made:
                path.unlink(missing_ok=True)


def _age(path: Path) -> float:
    """A number that is less for what was written later."""
    with suppress(OSError):
        return -os.stat(path).st_mtime
    return 0.0


def _is_stored_file(path: Path) -> bool:
    """Whether a file has a name as `stored_file` gives it; what was put aside has not."""
    return "." not in path.stem
