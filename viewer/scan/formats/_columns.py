"""Named columns, as PLY, PCD and text files hold points, and what a PointCloud becomes in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, count, islice
from typing import IO, AnyStr, BinaryIO, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ...errors import InputError
from ..admission import LONGEST_LINE
from ..points import PointCloud
from ..reading import numbers
from ..reading.cloud import ELLIPSES, GEOMETRY
from ..reading.columns import canonical_names
from ..reading.sequence import Decided
from ._precision import is_enough

_START = 16  # bytes of a file that tell its encoding
_AT_ONCE = 1 << 18  # points worked on together, so that no second table of them is needed
Columns = dict[str, NDArray]  # name -> (N,)
T = TypeVar("T")


def named(pairs: Iterable[tuple[str, NDArray]]) -> dict[str, NDArray]:
    """Columns by name; the fourth is called `column_4` where it has none.

    Columns that other programs call `Points:0` or `x [mm]` are called x here, see `canonical_names`. Of
    several scalars of one name the second is called `name_2`, and so on.

    Raises InputError where two columns have a name of geometry, in any case: nobody knows which counts.
    """
    columns: dict[str, NDArray] = {}
    seen: dict[str, int] = {}
    names, values = [], []
    for name, column in pairs:
        names.append(name)
        values.append(column)
    for index, (name, column) in enumerate(zip(canonical_names(names), values, strict=True), 1):
        name = name or f"column_{index}"
        key = name.lower() if name.lower() in GEOMETRY else name
        seen[key] = seen.get(key, 0) + 1
        if seen[key] > 1:
            if key in GEOMETRY:
                raise InputError(f"two columns have the name '{name}'", hint="Rename one of them")
            name = next(free for n in count(seen[key]) if (free := f"{name}_{n}") not in columns)
        columns[name] = column
    return columns


def first_repeated(names: Iterable[str]) -> str | None:
    """The first name that stands there a second time; None where all differ."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None


def columns_from_cloud(
    cloud: PointCloud, normals: tuple[str, str, str] = ("nx", "ny", "nz"), slack: float = 0.0
) -> dict[str, NDArray]:
    """Everything a cloud holds but its ids as named columns, positions absolute.

    Positions are float32 where that `is_enough`, else float64; slack: see there. normals: what their
    columns are called.
    Names lose their blanks, types that files do not know (bool, half, long double) are widened.
    """
    blocks = [
        (("x", "y", "z"), _absolute(cloud, slack)),
        (normals, cloud.normals),
        (("red", "green", "blue", "alpha"), cloud.colors),
        (("radius",), None if cloud.radii is None else cloud.radii[:, None]),
        (ELLIPSES, None if cloud.axes is None else _as_ellipses(cloud.axes)),
    ]
    columns = {
        name: block[:, i] for names, block in blocks if block is not None for i, name in enumerate(names)
    }
    for name, values in cloud.scalars.items():
        columns["_".join(name.split())] = values.astype(_STORED.get(values.dtype.char, values.dtype))
    return columns


_STORED = {"?": "u1", "e": "f4", "g": "f8"}  # numpy's type characters: bool, half, long double


def records(columns: Columns) -> NDArray[np.void]:
    """One little-endian record a point, (N,), fields packed in the order of the columns."""
    dtype = np.dtype([(name, column.dtype.newbyteorder("<")) for name, column in columns.items()])
    rows = np.empty(len(next(iter(columns.values()))), dtype)
    for name, column in columns.items():
        rows[name] = column
    return rows


def text_lines(stream: BinaryIO) -> Iterator[str]:
    """The lines of a stream from where it stands, as `bounded_lines`; Latin-1 takes any byte."""
    return (line.decode("latin-1") for line in bounded_lines(stream))


def check_encoding(head: bytes, kind: str) -> None:
    """Raise InputError where the first bytes of a file of this kind, such as "PLY", are UTF-16 or UTF-32."""
    encoding = numbers.encoding_of(head[:_START])
    if encoding.startswith(("utf-16", "utf-32")):
        raise InputError(
            f"is {encoding[:6].upper()} text, but {kind} files are ASCII or UTF-8",
            hint="Open the file in a text editor, and save it with the encoding UTF-8",
        )


def bounded_lines(stream: IO[AnyStr]) -> Iterator[AnyStr]:
    """The lines of a stream. Raises InputError where one is longer than any row of numbers."""
    for number, line in enumerate(stream, 1):
        if len(line) > LONGEST_LINE:
            raise InputError(f"line {number} has more than {LONGEST_LINE:,} characters")
        yield line


def parse_table(
    lines: Iterable[str],
    rows: int | None = None,
    decided: Decided | None = None,
) -> NDArray[np.float64]:
    """Numbers from lines of text, (N, C) float64, as `numbers.parse_numbers` reads them.

    Blanks separate them, or what `numbers.dialect_of` finds. decided: its record gets the decimal mark.
    """
    stated = decided.corrections.get("decimal") if decided else None
    dialect, lines = numbers.looked_at(lines, rows, stated)
    if decided is not None:
        decided.note(dialect.decisions(["decimal"] if stated else ())[1])
    return numbers.parse_numbers(lines, None, dialect, rows)


def whole_numbers(rows: Sequence[Sequence[str]]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The numbers of rows of words, one row behind the other, and how many each row has.

    Raises ValueError where a word is no whole number, OverflowError where it is far too large.
    """
    numbers = np.array([int(word) for word in chain.from_iterable(rows)], np.int64)
    return numbers, np.array([len(row) for row in rows], np.int64)


def batches(items: Iterable[T], size: int) -> Iterator[list[T]]:
    """The items in lists of so many; the last has what is left."""
    left = iter(items)
    while batch := list(islice(left, size)):
        yield batch


def declared(name: str, column: NDArray[np.float64], dtype: DTypeLike) -> NDArray:
    """A column parsed from text, in the type that the header declares.

    Coordinates stay float64: text may hold more digits than the declared type. A whole-number column
    that does not fit its type stays float64 too.
    """
    dtype = np.dtype(dtype)
    if name.lower() in ("x", "y", "z"):
        return column
    if dtype.kind in "iu":
        limits = np.iinfo(dtype)
        if not ((column >= limits.min) & (column <= limits.max)).all():
            return column
    return column.astype(dtype)


def _as_ellipses(axes: NDArray[np.float32]) -> NDArray[np.float32]:
    """The columns of ELLIPSES, (N, 5); zeros where a splat is round."""
    length = np.linalg.norm(axes[:, :3], axis=1, keepdims=True)
    return np.hstack([length, axes[:, 3:], axes[:, :3] / np.where(length > 0, length, 1)])


def _absolute(cloud: PointCloud, slack: float) -> NDArray[np.float32] | NDArray[np.float64]:
    if not cloud.origin.any() and cloud.remainders is None:
        return cloud.positions
    world = cloud.world()
    single = world.astype(np.float32)
    return single if is_enough(single, world, slack) else world
