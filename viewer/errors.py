"""Errors that a user can cause, each one message: what failed, where, what to try."""

from __future__ import annotations


class Scan4DError(Exception):
    """Base of all errors that are shown to a user without a traceback.

    what: what failed, one clause. where: the file, frame or name it concerns.
    hint: what to try. `exit_code` is what the command line ends with.
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


class NoOpenGLError(Scan4DError):
    """No OpenGL that Scan4D can use."""

    exit_code = 3


def unknown_name(kind: str, name: str, known: list[str] | tuple[str, ...]) -> InputError:
    """The error for a name that is not one of `known`; it lists them all."""
    return InputError(f"unknown {kind} '{name}'", hint=f"Known: {', '.join(sorted(known))}")
