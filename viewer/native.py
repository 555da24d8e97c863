"""Libraries in C, below Python: what they write on standard error, and memory that they keep."""

from __future__ import annotations

import ctypes
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Lock

from .unfinished import nameless_file

OPENEXR = re.compile(rb".*\(EXR_ERR_\w+\)|\s*$")  # the lines of OpenEXR, and empty ones
# Those of libtiff, which begin with the name of a function or of a file of Pillow's, and no exception's.
LIBTIFF = re.compile(
    rb"(?!\w+(?:Error|Exception|Exit|Interrupt|Warning):)(?:[A-Z_]\w*|tempfile\.tif): |More samples per|\s*$"
)
_STDERR = 2
_turn = Lock()  # there is one standard error


def give_memory_back() -> None:
    """Have the C library give memory that was freed back to the system, where it can be asked to (glibc)."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


@contextmanager
def unsaid(lines: re.Pattern[bytes]) -> Iterator[None]:
    """Leave out the lines that a library writes on standard error meanwhile.

    lines: what theirs match. What others write there comes afterwards. One thread at a time.
    """
    with _turn:
        try:
            before, kept = os.dup(_STDERR), nameless_file()
        except OSError:  # it is closed, or there is no room: then they are not left out
            yield
            return
        with kept:
            try:
                os.dup2(kept.fileno(), _STDERR)
                yield
            finally:
                os.dup2(before, _STDERR)
                os.close(before)
                kept.seek(0)
                others = b"".join(line for line in kept if not lines.match(line))
                if others and sys.stderr is not None:
                    sys.stderr.write(others.decode(errors="replace"))
