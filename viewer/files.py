"""Files that are whole or not there, and names that are free."""

from __future__ import annotations

import errno
import json
import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BufferedReader
from itertools import count
from pathlib import Path
from typing import Any

from .errors import InputError, explained, shortened
from .unfinished import temporary_file

_LONGEST_NAME = 500  # characters of a path inside a folder


@contextmanager
def whole_file(path: Path | str) -> Iterator[Path]:
    """A temporary file in the same folder; it becomes `path` only if the block ends well.

    Whatever goes wrong, a former file of that name stays as it was and nothing else remains. Only this user
    can read files in Scan4D's own folders, which are made where they are missing (see `new_file`).
    Raises InputError where the file cannot be written.
    """
    path = Path(path)
    try:
        with temporary_file(path) as temporary:
            yield temporary
            _store(temporary)
            os.replace(temporary, path)
        with suppress(OSError):  # not every file system can
            _store(path.parent)
    except OSError as error:
        what, hint = explained(error, "Check free space and permissions")
        raise InputError(f"cannot be written: {what}", path, hint) from error


def save_json(path: Path | str, data: Any) -> None:
    """Write data as a JSON file, in one step. Raises InputError where it cannot be written, and ValueError
    for NaN and infinities."""
    with whole_file(path) as temporary:
        text = json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False)
        temporary.write_text(text + "\n", encoding="utf-8")


def output_folder(path: Path) -> None:
    """Make a folder that the user has named for output, where it is missing. Raises InputError."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        what, hint = explained(error)
        raise InputError(f"cannot be created: {what}", path, hint) from error


def _store(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk, so that a power cut finds them whole."""
    is_folder = os.path.isdir(path)
    if is_folder and os.name == "nt":  # where folders cannot be opened
        return
    descriptor = os.open(path, os.O_RDONLY if is_folder else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def open_plain(path: Path | str) -> Iterator[BufferedReader]:
    """A file, open for reading bytes. Raises OSError, also where it is a folder, a device or a pipe.

    None of these is waited for or read from.
    """
    waiting = getattr(os, "O_NONBLOCK", 0)  # without it, opening a pipe waits for a writer
    with open(path, "rb", opener=lambda name, flags: os.open(name, flags | waiting)) as stream:
        if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
            raise OSError(errno.EINVAL, "is not a regular file", str(path))
        yield stream


def read_text(path: Path | str, most_bytes: int) -> str:
    """The text of a plain file in UTF-8 of at most so many bytes. Raises OSError, UnicodeDecodeError."""
    with open_plain(path) as stream:
        held = os.fstat(stream.fileno()).st_size  # Python takes memory for all that it is asked for
        data = stream.read(min(held, most_bytes) + 1)
    if len(data) > most_bytes:
        raise OSError(errno.EINVAL, f"is longer than {most_bytes:,} bytes", str(path))
    return data.decode("utf-8")


@contextmanager
def reading(path: Path | str, not_parsed: str, hint: str | None = None) -> Iterator[None]:
    """Raise InputError, which names the file, for what goes wrong inside. not_parsed: words for a text that
    cannot be parsed. hint: for errors without one."""
    try:
        yield
    except InputError as error:
        where = ", ".join(map(str, filter(None, (path, error.where))))
        raise InputError(error.what, where, error.hint or hint) from None
    except OSError as error:
        what, how = explained(error)
        raise InputError(f"cannot be read: {what}", path, how) from error
    except ValueError as error:  # of the text's encoding as well
        raise InputError(f"{not_parsed} ({error})", path, hint) from error


def parsed_json(text: str) -> Any:
    """The value of a JSON text, NaN and infinities among them. Raises ValueError, whatever is wrong."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("the JSON data are nested too deeply") from None


def parsed_toml(text: str) -> dict[str, Any]:
    """The tables of a TOML text. Raises ValueError, whatever is wrong."""
    import tomllib

    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("the JSON data are nested too deeply") from None


def named_inside(folder: Path, name: str, where: object) -> Path:
    """The file in a folder that another file names: the rule for every path that stands in a scan's files.

    where: the file that names it. Raises InputError, which names that, where the name leads out of the
    folder, is the folder itself, or cannot be one. Links in the folder are the user's own, and may lead out.
    """
    path = Path(name)
    leads_out = path.is_absolute() or path.drive or path.root or ".." in re.split(r"[\\/]", name)
    if leads_out or not path.name or not name.isprintable() or not 0 < len(name) <= _LONGEST_NAME:
        hint = "Put the named file into this folder, and write its name without a path"
        raise InputError(f"names '{shortened(name)}', which is not a file in its folder", where, hint)
    return folder / path


def free_file(folder: Path, suffix: str) -> Path:
    """scan4d_0001 with this suffix, or the next number that no file in the folder has."""
    paths = (folder / f"scan4d_{n:04d}{suffix}" for n in count(1))
    return next(path for path in paths if not os.path.exists(path))


def working_folder() -> Path:
    """The working directory, or the user's own folder where that is gone."""
    try:
        return Path.cwd()
    except OSError:
        return Path(os.path.expanduser("~"))


def absolute(path: Path | str) -> str:
    """A path from the root, as `os.path.abspath` gives it, also where the working directory is gone."""
    return os.path.normpath(os.path.join(working_folder(), path))


def printable(name: str) -> str:
    """A file's name as it can be shown: what is not UTF-8 in it is replaced."""
    return os.fsencode(name).decode(errors="replace")
