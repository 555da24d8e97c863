"""Files that are whole or not there, and names that are free."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from .errors import InputError


@contextmanager
def whole_file(path: Path | str) -> Iterator[Path]:
    """A temporary path in the same folder; it becomes `path` only if the block ends well.

    Whatever goes wrong, a former file of that name stays as it was and nothing else remains.
    Raises InputError where the file cannot be written.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        what = f"cannot be written: {error.strerror or error}"
        raise InputError(what, path, "Check free space and permissions") from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def user_folder() -> Path:
    """Where the settings of this user are kept; it need not be there yet."""
    import platformdirs

    return platformdirs.user_config_path("scan4d", appauthor=False)


def cache_folder() -> Path:
    """Where what was found out about this machine is kept for this user; it need not be there yet."""
    import platformdirs

    return platformdirs.user_cache_path("scan4d", appauthor=False)


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
