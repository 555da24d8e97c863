"""Where Scan4D keeps what belongs to a user, and how it makes files: for that user alone, through no link."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

_OTHERS = 0o077  # what everybody but the owner may do
# A file that is not there yet, and not at the end of a link. What is written goes to its end.
_NEW = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND
_NEW |= getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)


def user_folder() -> Path:
    """The folder of this user's settings; it need not be there yet."""
    import platformdirs

    return platformdirs.user_config_path("scan4d", appauthor=False)


def cache_folder() -> Path:
    """The folder of what was found out about this machine for this user; it need not be there yet."""
    import platformdirs

    return platformdirs.user_cache_path("scan4d", appauthor=False)


def state_folder() -> Path:
    """The folder of what this user has not finished; it need not be there yet."""
    import platformdirs

    return platformdirs.user_state_path("scan4d", appauthor=False)


def new_file(path: Path) -> int:
    """Create a file for writing; returns its descriptor. Raises OSError, also where the name is taken.

    In a folder of Scan4D's own, which is made where it is missing, only this user can read the file.
    Elsewhere the user's umask holds.
    """
    return os.open(path, _NEW, 0o600 if own_folder(path.parent) else 0o666)


def new_folder(path: Path) -> None:
    """Create a folder that only this user can read. Raises OSError, also where the name is taken."""
    own_folder(path.parent)
    path.mkdir(mode=0o700)


def own_folder(folder: Path) -> bool:
    """Whether a folder is one of Scan4D's own: it is made then where it is missing, and closed to others.

    Raises PermissionError where it belongs to another user.
    """
    folder = Path(os.path.abspath(folder))
    own = (user_folder(), cache_folder(), state_folder())
    root = next((root for root in own if folder.is_relative_to(root)), None)
    if root is None:
        return False
    inner = folder.relative_to(root).parts
    levels = [root.joinpath(*inner[:depth]) for depth in range(len(inner) + 1)]
    for level in [*reversed(root.parents), *levels]:  # who can write to a parent can put another folder here
        if not level.is_dir():
            with suppress(FileExistsError):
                level.mkdir(mode=0o700)
    if os.name != "nt":  # where modes say nothing, and the folder of a user is closed by itself
        found = [os.stat(level) for level in levels]
        if any(level.st_uid != os.geteuid() for level in found):
            raise PermissionError(errno.EPERM, "belongs to another user", str(folder))
        if any(level.st_mode & _OTHERS for level in found):
            _close(root)
    return True


def forget_oldest(folder: Path, most: int) -> None:
    """Remove the files of a folder that were used longest ago, until the rest has at most so many bytes."""
    with suppress(OSError):
        files = sorted(((path.stat().st_mtime_ns, path) for path in folder.glob("*.json")), reverse=True)
        for _, path in files:
            most -= path.stat().st_size
            if most < 0:
                path.unlink()


def _close(root: Path) -> None:
    """Take a folder, and all in it, from other users: earlier versions made them for everybody to read."""
    for path in _tree(root):
        with suppress(OSError):  # some file systems have no modes
            mode = os.stat(path).st_mode
            os.chmod(path, stat.S_IMODE(mode) & ~_OTHERS)


def _tree(root: Path) -> Iterator[str]:
    """The folder, and the files and folders in it; links aside."""
    yield str(root)
    for folder, folders, files in os.walk(root):
        paths = (os.path.join(folder, name) for name in folders + files)
        yield from (path for path in paths if not os.path.islink(path))
