"""Mesa's cache of compiled shaders, switched off where it could end the process.

Mesa maps the index of its cache into memory without making room for it on the disk: where that is full, its
first shader ends the process with SIGBUS.
"""

from __future__ import annotations

import os
import sys
from functools import cache
from pathlib import Path

from ..errors import explained
from ..unfinished import nameless_file

_DISABLE = "MESA_SHADER_CACHE_DISABLE"
_FOLDER = "mesa_shader_cache"
_ROOM = 4 * 2**20  # bytes: 1.3 MB for the index, and some for shaders


@cache
def shader_cache() -> str | None:
    """Tell where shaders are kept, or why they are not; None where the system has no Mesa.

    To be called before a context is made: it switches the cache off for this process where its folder cannot
    be written or has no room.
    """
    if not sys.platform.startswith("linux"):
        return None
    if os.environ.get(_DISABLE, "").lower() in ("1", "true", "yes", "y"):
        return f"off: {_DISABLE} is set"
    folder = _cache_folder()
    try:
        _try_to_write(folder)
    except OSError as error:
        os.environ[_DISABLE] = "true"
        what, _ = explained(error)
        return f"off: {folder}: {what}"
    return str(folder)


def _cache_folder() -> Path:
    """The folder that Mesa uses (src/util/disk_cache_os.c)."""
    named = [os.environ.get(name) for name in ("MESA_SHADER_CACHE_DIR", "MESA_GLSL_CACHE_DIR")]
    parent = next(filter(None, [*named, os.environ.get("XDG_CACHE_HOME")]), None)
    return Path(parent or _home() / ".cache") / _FOLDER


def _home() -> Path:
    """The user's home folder as the system knows it, whatever HOME says."""
    import pwd

    try:
        return Path(pwd.getpwuid(os.getuid()).pw_dir)
    except KeyError:  # in some containers
        return Path(os.path.expanduser("~"))


def _try_to_write(folder: Path) -> None:
    """Raise OSError where the folder has no room for a cache; it need not be there yet."""
    while not os.path.lexists(folder):
        folder = folder.parent
    with nameless_file(folder) as file:
        os.posix_fallocate(file.fileno(), 0, _ROOM)
