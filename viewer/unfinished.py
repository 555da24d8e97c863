"""Temporary files and folders: all that Scan4D makes are made here.

Nobody can foretell their names, and none is made through a link. A killed process cannot tidy up: so each
process notes what it makes in a file of its own in the cache folder, beside a lock that it holds while it
lives. Where the lock is free, the next start of Scan4D deletes what is noted.
"""

from __future__ import annotations

import atexit
import os
import re
import secrets
import shutil
import stat
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from .folders import cache_folder, new_file, new_folder, own_folder

_TOKEN = 8  # bytes of chance in a name
_FILE = re.compile(rf"\..+\.[0-9a-f]{{{2 * _TOKEN}}}\.part(\.[^.]+)?", re.DOTALL)  # as `_beside` has it
_FOLDER = re.compile(rf"\.scan4d_[0-9a-f]{{{2 * _TOKEN}}}")
_LONGEST_NAME = 255  # bytes, on the file systems of today
_LOCK = ".lock"


@contextmanager
def temporary_file(path: Path) -> Iterator[Path]:
    """A new, empty file beside `path`, which may become it; deleted at the end, if it is still there.

    Raises OSError where it cannot be made.
    """
    with _noted(_beside(path)) as temporary:
        os.close(new_file(temporary))
        yield temporary


@contextmanager
def temporary_folder(parent: Path | None = None) -> Iterator[Path]:
    """A new folder that only this user can read; deleted at the end, with all in it. Raises OSError.

    parent: the folder to make it in. None: the system's folder of temporary files.
    """
    parent = Path(tempfile.gettempdir()) if parent is None else parent
    with _noted(parent / f".scan4d_{secrets.token_hex(_TOKEN)}") as folder:
        new_folder(folder)
        yield folder


def nameless_file(folder: Path | None = None) -> IO[bytes]:
    """A file without a name, which is gone when it is closed, however this process ends. Raises OSError.

    folder: where to make it. None: the system's folder of temporary files.
    """
    return tempfile.TemporaryFile(dir=folder)


def _beside(path: Path) -> Path:
    """A name for a file that becomes `path`. One that would be too long loses its beginning."""
    stem, rest = path.stem, f".{secrets.token_hex(_TOKEN)}.part{path.suffix}"
    while stem[1:] and len(os.fsencode(f".{stem}{rest}")) > _LONGEST_NAME:
        stem = stem[1:]
    return path.with_name(f".{stem}{rest}")


def remove_leftovers() -> None:
    """Delete what processes that are gone have noted; nothing whose name has another form than theirs."""
    with suppress(OSError):
        for lock_file in [entry for entry in _folder().iterdir() if entry.suffix == _LOCK]:
            if lock_file != _NOTES.lock_file:
                _remove_noted(lock_file)


@contextmanager
def _noted(path: Path) -> Iterator[Path]:
    # From the root, without links: at a later start nothing else can stand for it.
    noted = os.path.join(os.path.realpath(path.parent), path.name)
    _NOTES.add(noted)
    try:
        yield path
    finally:
        _remove(noted)
        _NOTES.drop(noted)


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

    def add(self, path: str) -> None:
        with self._guard, suppress(OSError):
            self._there.add(path)
            self._begin()
            if self._stream is not None:
                self._stream.write(os.fsencode(path) + b"\0")

    def drop(self, path: str) -> None:
        with self._guard, suppress(OSError):
            self._there.discard(path)
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
        own_folder(folder)
        lock_file = folder / f"{os.getpid()}_{secrets.token_hex(4)}{_LOCK}"
        lock = FileLock(lock_file, timeout=1, mode=0o600, thread_local=False, fallback_to_soft=False)
        lock.acquire()  # Timeout is an OSError
        self.lock_file, self._lock = lock_file, lock
        self._stream = os.fdopen(new_file(lock_file.with_suffix("")), "wb", buffering=0)

    def _end(self) -> None:
        """Delete what an interrupt of the tidying has left, and the notes."""
        for path in self._there:
            _remove(path)
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
        if not any([_remains(os.fsdecode(path)) for path in noted]):  # all are tried
            notes.unlink(missing_ok=True)
            lock_file.unlink()


def _remains(path: str) -> bool:
    """Delete a noted file or folder; whether it is still there. What is not of our form is left alone."""
    folder, name = os.path.split(path)
    if not (os.path.isabs(path) and os.path.realpath(folder) == folder):
        return False
    if not (_FILE.fullmatch(name) or _FOLDER.fullmatch(name)):
        return False
    _remove(path)
    return os.path.lexists(path)


def _remove(path: str) -> None:
    """Delete a file of the one form, or a folder of the other; links are not followed."""
    with suppress(OSError):
        mode, name = os.lstat(path).st_mode, os.path.basename(path)
        if stat.S_ISDIR(mode) and _FOLDER.fullmatch(name):
            shutil.rmtree(path, ignore_errors=True)
        elif stat.S_ISREG(mode) and _FILE.fullmatch(name):
            os.unlink(path)
