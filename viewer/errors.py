"""Errors that a user can cause, each one message: what failed, where, what to try."""

from __future__ import annotations

import errno
import re
import reprlib
from collections.abc import Iterable

_SHOWN = 80  # characters of a value that a message shows
_LONGEST_REASON = 200  # characters of what a library says


class Scan4DError(Exception):
    """Base of all errors that are shown to a user without a traceback.

    what: what failed, one clause. where: the file, frame or name it concerns. hint: what to try. `exit_code`
    is the exit code of the command line.
    """

    exit_code = 1

    def __init__(self, what: str, where: object = None, hint: str | None = None) -> None:
        super().__init__(what, where, hint)
        self.what = what
        self.where = where
        self.hint = hint

    def __str__(self) -> str:
        head = self.what if self.where is None else f"{self.where}: {self.what}"
        return head if self.hint is None else f"{head}. {self.hint}"


class InputError(Scan4DError):
    """Unusable input: a scan, a file or an argument."""

    exit_code = 2


class EmptyFrame(InputError):
    """A frame that is complete and holds no points."""


class MissingPackageError(InputError, ModuleNotFoundError):
    """A library that is not installed (viewer/imports.py)."""


class NoOpenGLError(Scan4DError):
    """No OpenGL that Scan4D can use."""

    exit_code = 3


def unknown_name(kind: str, name: str, known: Iterable[str]) -> InputError:
    """Error for a name that is not in `known`. Its hint suggests similar names and lists all."""
    known = sorted(set(known))
    hint = f"{did_you_mean(name, known)}Known: {', '.join(known)}"
    return InputError(f"unknown {kind} '{shortened(name)}'", hint=hint)


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """A question with similar names, "Did you mean 'points'? "; empty without any."""
    import difflib  # 3 ms

    close = difflib.get_close_matches(name[:_SHOWN], list(known), n=2)
    return f"Did you mean {' or '.join(map(repr, close))}? " if close else ""


def shortened(value: object) -> str:
    """Any value as messages show it; long ones are cut."""
    text = value if isinstance(value, str) else reprlib.repr(value)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


_PERMISSION = "permission denied", "Check the permissions of the file and of its folder"
_FULL = "the disk is full", "Free some space, or use another disk"
_SYSTEM = {
    errno.EACCES: _PERMISSION,
    errno.EPERM: _PERMISSION,
    errno.ENOSPC: _FULL,
    getattr(errno, "EDQUOT", errno.ENOSPC): _FULL,  # a share of it
    errno.EFBIG: ("the file would be larger than this disk can store", "Use another disk"),
    errno.EROFS: ("the file system is read-only", "Use another folder"),
    errno.ENAMETOOLONG: ("the name of the file is too long", "Use a shorter name"),
    errno.ENOENT: ("no such file or folder", "Check its name"),
    errno.EISDIR: ("is a folder", "Name a file in it"),
    errno.ENOTDIR: ("a part of the path is not a folder", "Check its name"),
    errno.ELOOP: ("its links form a loop", "Name the file itself, not a link"),
    errno.EMFILE: ("too many files are open", "Close other programs, or raise 'ulimit -n'"),
    errno.ENFILE: ("too many files are open", "Close other programs"),
    errno.ENOMEM: ("not enough memory", "Close other programs"),
    errno.EIO: ("the disk failed to read or write the file", "Copy the file to another disk"),
}
_CUT_SHORT = re.compile(r"[0-9]+ requested and [0-9]+ written")  # all that numpy tells of a full disk


def explained(error: OSError, hint: str | None = None) -> tuple[str, str | None]:
    """Reason and advice where the system refused: "the disk is full", "Make room, or use another disk".

    hint: what to try for an unknown cause.
    """
    number = errno.ENOSPC if _CUT_SHORT.match(str(error)) else error.errno
    return _SYSTEM.get(number or 0, (error.strerror or str(error) or type(error).__name__, hint))


def failure_in_words(what: str, error: BaseException) -> str:
    """One line for users, that something failed. what: was being done."""
    if isinstance(error, Scan4DError):
        return str(error)
    return f"{what} failed ({reason(error)}); everything else still works."


def reason(error: BaseException) -> str:
    """The words of an error, and its kind unless it is meant for users."""
    if isinstance(error, Scan4DError):
        return str(error)
    said = " ".join(str(error).split())[:_LONGEST_REASON]
    return f"{type(error).__name__}{': ' if said else ''}{said}"
