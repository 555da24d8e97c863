"""Temporary files and folders, noted for this user before they are made and until they are gone.

Who is killed cannot tidy up. Each process notes what it makes in a file of its own in the cache folder,
beside a lock that it holds as long as it lives: where the lock is free, what is noted is deleted at the
next start of whoever writes.
"""

from __future__ import annotations

import atexit
import os
import re
import secrets
import shutil
import stat
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from .folders import cache_folder

_FILE = re.compile(r"\..+\.[0-9]+\.part(\.[^.]+)?", re.DOTALL)  # as `temporary_name` has it
_FOLDER = re.compile(r"\.scan4d_[0-9a-z_]+")
_LONGEST_NAME = 255  # bytes, on the file systems of today
_LOCK = ".lock"


def temporary_name(path: Path) -> Path:
    """The file beside `path` that becomes it. A name that would be too long keeps its end, the number."""
    stem, rest = path.stem, f".{os.getpid()}.part{path.suffix}"
    while stem[1:] and len(os.fsencode(f".{stem}{rest}")) > _LONGEST_NAME:
        stem = stem[1:]
    return path.with_name(f".{stem}{rest}")


@contextmanager
def temporary_file(path: Path) -> Iterator[Path]:
    """The name of a temporary file beside `path`; the file is deleted at the end, if it is still there."""
    with _noted(temporary_name(path)) as temporary:
        yield temporary


@contextmanager
def temporary_folder(parent: Path) -> Iterator[Path]:
    """A new folder in this one, `.scan4d_*`; it is deleted at the end, with all in it. Raises OSError."""
    with _noted(parent / f".scan4d_{secrets.token_hex(4)}") as folder:
        folder.mkdir(mode=0o700)
        yield folder


def remove_leftovers() -> None:
    """Delete what processes that are gone have noted; nothing whose name has another form than theirs."""
    with suppress(OSError):
        for lock_file in [entry for entry in _folder().iterdir() if entry.suffix == _LOCK]:
            if lock_file != _NOTES.lock_file:
                _remove_noted(lock_file)


@contextmanager
def _noted(path: Path) -> Iterator[Path]:
    # From the root, without links: at a later start nothing else can stand for it.
    place = os.path.join(os.path.realpath(path.parent), path.name)
    _NOTES.add(place)
    try:
        yield path
    finally:
        _remove(place)
        _NOTES.drop(place)


def _folder() -> Path:
    return cache_folder() / "unfinished"


class _Notes:
    """Notes of what this process has not finished. Where nothing can be noted it works without."""

    def __init__(self) -> None:
        self.lock_file: Path | None = None
        self._there: set[str] = set()
        self._stream: IO[bytes] | None = None
        self._lock: Any = None
        self._began = False
        self._guard = threading.Lock()

    def add(self, place: str) -> None:
        with self._guard, suppress(OSError):
            self._there.add(place)
            self._begin()
            if self._stream is not None:
                self._stream.write(os.fsencode(place) + b"\0")

    def drop(self, place: str) -> None:
        with self._guard, suppress(OSError):
            self._there.discard(place)
            if self._stream is not None and not self._there:
                self._stream.truncate(0)

    def _begin(self) -> None:
        """Make the file and its lock, once."""
        if self._began:
            return
        self._began = True
        atexit.register(self._end)
        from filelock import FileLock

        folder = _folder()
        folder.mkdir(parents=True, exist_ok=True)
        lock_file = folder / f"{os.getpid()}_{secrets.token_hex(4)}{_LOCK}"
        lock = FileLock(lock_file, timeout=1, thread_local=False, fallback_to_soft=False)
        lock.acquire()  # Timeout is an OSError
        self.lock_file, self._lock = lock_file, lock
        self._stream = open(lock_file.with_suffix(""), "ab", buffering=0)  # noqa: SIM115

    def _end(self) -> None:
        """Delete what an interrupt of the tidying has left, and the notes."""
        for place in self._there:
            _remove(place)
        if self._stream is not None and self.lock_file is not None:
            self._stream.close()
            with suppress(OSError):
                self.lock_file.with_suffix("").unlink()
                self.lock_file.unlink()
        if self._lock is not None:
            self._lock.release()


_NOTES = _Notes()


def _remove_noted(lock_file: Path) -> None:
    """Delete what is noted beside a lock, where nobody holds it; what cannot be deleted stays noted."""
    from filelock import FileLock

    notes = lock_file.with_suffix("")
    with suppress(OSError), FileLock(lock_file, timeout=0, fallback_to_soft=False):
        noted = notes.read_bytes().split(b"\0") if notes.exists() else []
        if not any([_remains(os.fsdecode(place)) for place in noted]):  # all are tried
            notes.unlink(missing_ok=True)
            lock_file.unlink()


def _remains(place: str) -> bool:
    """Delete a noted file or folder; whether it is still there. What is not of our form is left alone."""
    folder, name = os.path.split(place)
    if not (os.path.isabs(place) and os.path.realpath(folder) == folder):
        return False
    if not (_FILE.fullmatch(name) or _FOLDER.fullmatch(name)):
        return False
    _remove(place)
    return os.path.lexists(place)


def _remove(place: str) -> None:
    """Delete a file of the one form, or a folder of the other; links are not followed."""
    with suppress(OSError):
        mode, name = os.lstat(place).st_mode, os.path.basename(place)
        if stat.S_ISDIR(mode) and _FOLDER.fullmatch(name):
            shutil.rmtree(place, ignore_errors=True)
        elif stat.S_ISREG(mode) and _FILE.fullmatch(name):
            os.unlink(place)
