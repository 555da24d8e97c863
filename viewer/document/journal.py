"""Recordings as they grow, on disk: what a killed process had recorded is saved at the next start.

A journal is a file of JSON lines in the user's state folder. The first line says where the recording was to
go, each other one is an entry as recordings have it. Beside it lies a lock, which the process that records
holds: the system frees it, however that process ends.
"""

from __future__ import annotations

import json
import os
import secrets
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from .. import __version__
from ..errors import InputError, explained
from ..files import free_file, read_text
from ..folders import new_file, own_folder, state_folder
from ..scan.open import is_no_path
from .recording import FORMAT, Recording
from .schema import DAMAGED

_SUFFIX, _LOCK, _ASIDE = ".jsonl", ".lock", ".damaged"
_MOST_BYTES = 256 * 2**20


class Journal:
    """Journal of a recording, from its first entry to `remove`. Raises OSError where it cannot be written."""

    def __init__(self, folder: Path) -> None:
        """folder: where the recording is to go, which names of scans start from."""
        from filelock import FileLock

        journals = journal_folder()
        own_folder(journals)
        self._path = journals / f"{os.getpid()}_{secrets.token_hex(4)}{_SUFFIX}"
        self._lock = FileLock(
            self._path.with_suffix(_LOCK), timeout=1, mode=0o600, thread_local=False, fallback_to_soft=False
        )
        self._lock.acquire()
        self._stream = os.fdopen(new_file(self._path), "wb", buffering=0)
        self.add({"format": FORMAT, "version": __version__, "folder": str(folder)})

    def add(self, change: Mapping[str, Any]) -> None:
        """Note an entry, as `Recorder.note` gives it."""
        self._stream.write(json.dumps(change).encode() + b"\n")

    @property
    def is_closed(self) -> bool:
        """Whether nothing can be added any more."""
        return self._stream.closed

    def close(self) -> None:
        """Write no more; it stays that of this process until `remove` or `leave`."""
        self._stream.close()

    def leave(self) -> None:
        """Write no more; what is there is saved at the next start."""
        self.close()
        self._lock.release()

    def remove(self) -> None:
        """The recording is saved, or given up."""
        self.leave()
        _delete(self._path)


def journals() -> list[Path]:
    """The journals of this user, also those of processes that still record."""
    with suppress(OSError):
        return sorted(path for path in journal_folder().iterdir() if path.suffix == _SUFFIX)
    return []


def saved(journal: Path) -> Path | None:
    """Save a journal whose process is gone under a free name, where it was to go or in the user's documents.

    None where the process lives or nothing was recorded. Raises InputError where it cannot be saved: the
    journal stays; or read: it is put aside.
    """
    from filelock import FileLock, Timeout

    try:
        with FileLock(journal.with_suffix(_LOCK), timeout=0, fallback_to_soft=False):
            path = _saved(journal)
    except Timeout:
        return None
    except OSError as error:
        raise InputError(f"cannot be saved: {explained(error)[0]}", journal) from error
    _delete(journal)
    return path


def _saved(journal: Path) -> Path | None:
    try:
        head, *changes = _lines(read_text(journal, _MOST_BYTES)) or [{}]
    except FileNotFoundError:  # by another window
        return None
    except UnicodeDecodeError as error:
        raise _put_aside(journal, "is not text") from error
    if not changes:
        return None
    folder = head.pop("folder", None)
    if not isinstance(folder, str):
        raise _put_aside(journal, "does not contain the name of its folder")
    try:
        recording = Recording.from_json(head | {"entries": changes}, journal)
    except InputError as error:
        raise _put_aside(journal, error.what) from error
    return written(recording, Path(folder))


def _lines(text: str) -> list[dict[str, Any]]:
    """The JSON objects of whole lines; a line that was cut ends them."""
    objects: list[dict[str, Any]] = []
    for line in text.splitlines(keepends=True):
        try:
            found = json.loads(line)
        except (ValueError, RecursionError):
            break
        if not line.endswith("\n") or not isinstance(found, dict):
            break
        objects.append(found)
    return objects


def written(recording: Recording, folder: Path) -> Path:
    """Save a recording under a free name in this folder, or in the user's documents or home where that fails.

    Raises InputError where none of them takes it.
    """
    for candidate in _folders(folder):
        path = free_file(candidate, ".json")
        try:
            (recording if candidate == folder else _from_root(recording, folder)).save(path)
        except InputError as error:
            problem = error
        else:
            return path
    raise problem


def _folders(folder: Path) -> Iterator[Path]:
    """Folders where a recording may go, the best first."""
    import platformdirs

    yield folder
    yield platformdirs.user_documents_path()
    yield Path(os.path.expanduser("~"))


def _from_root(recording: Recording, folder: Path) -> Recording:
    """The recording for another folder: its scans are named from the root."""

    def named(scan: str | None) -> str | None:
        return scan if scan is None or is_no_path(scan) else os.path.join(folder, scan or "")

    return replace(
        recording, entries=tuple(replace(entry, scan=named(entry.scan)) for entry in recording.entries)
    )


def _put_aside(journal: Path, what: str) -> InputError:
    kept = journal.with_suffix(_ASIDE)
    with suppress(OSError):
        os.replace(journal, kept)
    return InputError(f"an unfinished recording {what}", kept, DAMAGED)


def _delete(journal: Path) -> None:
    for path in (journal, journal.with_suffix(_LOCK)):
        with suppress(OSError):
            path.unlink()


def journal_folder() -> Path:
    """The folder of this user's journals; it need not be there yet."""
    return state_folder() / "recordings"
