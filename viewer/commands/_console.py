"""What a command says while it works: results on standard output; warnings and progress on standard error.

Control characters that files and names bring are shown as \\x1b, and do nothing to a terminal. What was
written is named as it is where a program reads that.
"""

from __future__ import annotations

import codecs
import errno
import json
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import Any, TextIO

from ..errors import Scan4DError, explained

# What ends lines or moves, colours or turns round what stands there; and surrogates, which nothing can show.
_CONTROLS = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
_is_quiet = False
# How a stream treats what is no text: the bytes of names stay, all else is escaped.
NAMES_AS_THEY_ARE = "scan4d.names"


def escaped(text: str, except_for: str = "") -> str:
    """The text with its control characters escaped, except for these."""
    return _CONTROLS.sub(lambda found: found[0] if found[0] in except_for else repr(found[0])[1:-1], text)


def warn(text: str) -> None:
    """One line on standard error, above a progress bar if there is one; none under --quiet."""
    if not _is_quiet:
        complain(f"scan4d: {escaped(text)}")


def complain(text: str) -> None:
    """Text on standard error, above a progress bar if there is one. Where nobody can read it, it is lost."""
    text = escaped(text, except_for="\n")
    with suppress(OSError):
        if "tqdm" in sys.modules:
            sys.modules["tqdm"].tqdm.write(text, file=sys.stderr)
        else:
            print(text, file=sys.stderr)


def tell(*lines: object) -> None:
    """Lines on standard output, at once: what was written, or will take how long. None under --quiet.

    A Path is the name of a file, for programs to open.
    """
    if not _is_quiet:
        for line in lines:
            if isinstance(line, Path) and isinstance(sys.stdout, PlainOutput):
                sys.stdout.write_name(line)
            else:
                print(line)
        sys.stdout.flush()


def say(**values: object) -> None:
    """One line of JSON on standard output, at once."""
    print(json.dumps(values), flush=True)


@contextmanager
def quietly(is_quiet: bool) -> Iterator[None]:
    """Meanwhile there are no warnings, no progress and nothing to `tell`, if so."""
    global _is_quiet
    before, _is_quiet = _is_quiet, is_quiet
    try:
        yield
    finally:
        _is_quiet = before


@contextmanager
def progress(total: int, as_lines: bool = False) -> Iterator[Callable[[], object]]:
    """A function to call after each of `total` steps; a bar shows them where someone watches.

    It appears after a second, and only in a terminal. as_lines: for programs, a `say` for each step instead.
    """
    if as_lines:
        steps = count(1)
        yield lambda: say(drawn=next(steps), of=total)
        return
    if _is_quiet or not sys.stderr.isatty():
        yield lambda: None
        return
    from tqdm import tqdm

    with tqdm(total=total, delay=1, leave=False) as bar:
        yield bar.update


class Delays:
    """Prints each announcement once, where someone watches."""

    def __init__(self) -> None:
        self._announced: set[str] = set()

    def __call__(self, what: str) -> None:
        """A line on standard error, only in a terminal."""
        if what not in self._announced and sys.stderr.isatty():
            self._announced.add(what)
            warn(f"{what} ...")


class ReaderGone(Exception):
    """Nobody reads standard output any more, which is no failure to speak of."""


class PlainOutput:
    """Standard output as commands print to it: with control characters escaped.

    Names of files are not where the stream treats errors as NAMES_AS_THEY_ARE.
    Where it cannot be written it raises Scan4DError or ReaderGone, once; later output goes nowhere, so that
    Python does not complain of it at its end.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write as a stream does."""
        return self._do(lambda: self._stream.write(escaped(text, except_for="\n")))

    def write_name(self, path: Path) -> None:
        """The name of a file, on a line of its own."""
        is_exact = self._stream.errors == NAMES_AS_THEY_ARE
        self._do(lambda: self._stream.write(f"{path if is_exact else escaped(str(path))}\n"))

    def flush(self) -> None:
        """Flush as a stream does."""
        self._do(self._stream.flush)

    def _do(self, action: Callable[[], Any]) -> Any:
        try:
            return action()
        except OSError as error:
            with suppress(OSError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), self._stream.fileno())
            if isinstance(error, BrokenPipeError):
                raise ReaderGone from error
            is_closed = error.errno == errno.EBADF
            what, hint = ("the stream is closed", None) if is_closed else explained(error)
            raise Scan4DError(f"cannot be written: {what}", "standard output", hint) from error

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def _bytes_of_names(error: UnicodeError) -> tuple[bytes, int]:
    """Bytes to write for characters that are no text: those that they stand for in names, or escapes."""
    assert isinstance(error, UnicodeEncodeError)
    letters = error.object[error.start : error.end]
    return b"".join(map(_byte_or_escape, letters)), error.end


def _byte_or_escape(letter: str) -> bytes:
    is_byte = "\udc80" <= letter <= "\udcff"  # as `os.fsdecode` has it
    return bytes([ord(letter) - 0xDC00]) if is_byte else letter.encode("ascii", "backslashreplace")


codecs.register_error(NAMES_AS_THEY_ARE, _bytes_of_names)
