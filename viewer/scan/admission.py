"""What a file may take to be read. Every reader asks here before it allocates, and reads what it promises or
fails.

Reading may take 10 times the bytes of the file and 180 MiB more, and never more than half of the machine's
memory. Formats that pack honest scans far better may take more for each byte. The variable SCAN4D_READ_MB
replaces all that by a number of megabytes.

What is held at a time counts, copies and conversions included. A reader that needs more for honest files
should hold less, not ask for more.

Where a frame has several files, they share one budget (see `shared`): what was read of the frame counts when
the next file asks, and a file that is named again brings no more bytes.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, shortened
from ..files import open_plain
from .cache import megabytes

READ_VARIABLE = "SCAN4D_READ_MB"
MOST_COLUMNS = 4096  # the longest descriptors of points in use have 1344 values
MOST_FRAMES = 1 << 20  # of one file: nine hours at 30 a second
MOST_MEMBERS = 1024  # arrays of an archive, parts of a picture
LONGEST_LINE = 1 << 20  # characters of text

_MOST_DIGITS = 40  # of a number that counts something
_RATIO = 10  # of the memory that reading takes to the size of the file
_FREE = 180 << 20  # bytes that reading any file may take


@dataclass
class ReadBudget:
    """The memory that the files of one frame may take together.

    sizes: bytes of the files read so far, each once, by device and number. retained: bytes that hold
    what was read of them.
    """

    sizes: dict[tuple[int, int], int] = field(default_factory=dict)
    retained: int = 0

    @property
    def held(self) -> int:
        """Bytes of all files read so far."""
        return sum(self.sizes.values())


_shared: ContextVar[ReadBudget | None] = ContextVar("budget", default=None)  # of the frame that is read


@contextmanager
def shared() -> Iterator[ReadBudget]:
    """Have all files that are read meanwhile share one budget.

    A caller that holds results adds their bytes to `retained`.
    """
    token = _shared.set(ReadBudget())
    try:
        budget = _shared.get()
        assert budget is not None
        yield budget
    finally:
        _shared.reset(token)


@contextmanager
def opened(path: Path) -> Iterator[BinaryIO]:
    """A file, open to be read. Raises OSError, also where it is not a regular file.

    Raises InputError where the file has become shorter when all is read: then nobody knows what was.
    """
    with open_plain(path) as stream:
        held = size_of(stream)
        if (budget := _shared.get()) is not None:
            found = os.fstat(stream.fileno())
            budget.sizes[found.st_dev, found.st_ino] = held
        yield stream
        if size_of(stream) < held:
            raise InputError(
                "another program shortened this file while Scan4D read it",
                hint="Open the file again when it is complete",
            )


def size_of(stream: BinaryIO) -> int:
    """The bytes of an open file."""
    return os.fstat(stream.fileno()).st_size


def most_memory(held: int, ratio: int = _RATIO) -> int:
    """Bytes that reading a file of `held` bytes may take at a time. Raises InputError for a bad variable."""
    stated = megabytes(READ_VARIABLE)
    return min(ratio * held + _FREE, _half_of_memory()) if stated is None else stated


def _half_of_memory() -> int:
    if not hasattr(os, "sysconf"):  # Windows
        return 1 << 63
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2


def admit(held: int, needed: int, ratio: int = _RATIO) -> None:
    """Raise InputError, before anything is allocated, where a file would take more memory than it may.

    held: the bytes of the file. needed: those that reading it takes at most at a time. ratio: what it may
    take for each byte. Of a frame of several files, both are those of all (see `shared`).
    """
    if (budget := _shared.get()) is not None:
        held, needed = max(held, budget.held), needed + budget.retained
    if needed > most_memory(held, ratio):
        what = (
            f"reading this file of {held:,} bytes would need {needed / 1e6:,.0f} MB of memory, which is "
            "suspiciously much"
        )
        hint = f"If you trust the file, set the environment variable {READ_VARIABLE}={(needed >> 20) + 1}"
        raise InputError(what, hint=hint)


def check_count(number: int, most: int, what: str) -> None:
    """Raise InputError where a file has more of something than any scan; what: for example "columns"."""
    if number > most:
        raise InputError(f"has {number:,} {what}, but Scan4D reads at most {most:,}")


def whole_number(word: str, what: str) -> int:
    """A number of a file's text; what: for example "the length of 'faces'". Raises InputError."""
    if not re.fullmatch(rf"[+-]?[0-9]{{1,{_MOST_DIGITS}}}", word):
        raise InputError(f"{what} is {shortened(word)!r}, which is not a usable whole number")
    return int(word)


def read_exactly(stream: BinaryIO, size: int) -> bytes:
    """The next bytes of a stream. Raises InputError where there are fewer."""
    data = stream.read(size)
    if len(data) != size:
        raise InputError(f"ends early: it has {len(data)} bytes where {size} bytes should be")
    return data


def read_records(stream: BinaryIO, dtype: np.dtype, count: int, what: str) -> NDArray:
    """The next records of a file, (count,). what: as the file calls them. Raises InputError for fewer."""
    held = (size_of(stream) - stream.tell()) // dtype.itemsize
    rows = np.fromfile(stream, dtype, count if count <= held else 0)
    if len(rows) < count:
        raise too_few(min(held, len(rows) or held), count, what)
    return rows


def too_few(held: int, promised: int, what: str) -> InputError:
    """The error for a file that holds fewer rows than its header promises; what: as it calls them."""
    return InputError(f"contains only {held} of the {promised} {what} that its header states")
