"""Named columns, as PLY, PCD and text files hold points, to and from a PointCloud."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import chain, count, islice
from typing import IO, AnyStr, BinaryIO, TypeVar

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import DTypeLike, NDArray

from ...errors import InputError
from ..admission import LONGEST_LINE
from ..contents import Deferred
from ..points import PointCloud
from ..reading import numbers
from ._deferred import cloud_of
from ._precision import is_enough

_AT_ONCE = 1 << 18  # points worked on together, so that no second table of them is needed
Columns = dict[str, NDArray]  # name -> (N,)
T = TypeVar("T")

# What the columns of a file may be called, in lower case; the first set that is complete is taken.
_POSITIONS = [("x", "y", "z")]
_NORMALS = [("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z")]
_COLORS = [
    ("red", "green", "blue", "alpha"),
    ("red", "green", "blue"),
    ("r", "g", "b", "a"),
    ("r", "g", "b"),
    ("diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"),
    ("diffuse_red", "diffuse_green", "diffuse_blue"),
]
_RADII = [("radius",), ("surfel_radius",)]
_ELLIPSES = ("radius_u", "radius_v", "tangent_x", "tangent_y", "tangent_z")
_GEOMETRY = {"rgb", "rgba", *chain(*_POSITIONS, *_NORMALS, *_COLORS, *_RADII, _ELLIPSES)}


def named(pairs: Iterable[tuple[str, NDArray]]) -> dict[str, NDArray]:
    """Columns by name; the fourth is called `column_4` where it has none.

    Of several scalars of one name the second is called `name_2`, and so on.

    Raises InputError where two columns have a name of geometry, in any case: nobody knows which counts.
    """
    columns: dict[str, NDArray] = {}
    seen: dict[str, int] = {}
    for index, (name, column) in enumerate(pairs, 1):
        name = name or f"column_{index}"
        key = name.lower() if name.lower() in _GEOMETRY else name
        seen[key] = seen.get(key, 0) + 1
        if seen[key] > 1:
            if key in _GEOMETRY:
                raise InputError(f"two columns are called '{name}'", hint="Rename one of them")
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


def listed(names: Iterable[str], most: int = 12, longest: int = 24) -> str:
    """Names of a file for a message: some of them, shortened where they are long."""
    names = list(names)
    shown = [name if len(name) <= longest else name[:longest] + "..." for name in names[:most]]
    return ", ".join([*shown, f"and {len(names) - most} more"] if len(names) > most else shown) or "none"


def cloud_from_columns(columns: Columns, held: int | None = None) -> PointCloud:
    """Points from named columns; names count in any case, what is not geometry becomes a scalar.

    columns: name -> (N,) of any real type and byte order; emptied, so that each may go when it is used.
    held: bytes of the file, where the columns were packed in it.
    Raises InputError where x, y or z is missing, and where all that takes too much memory.
    """
    names = {name.lower(): name for name in columns}

    def found(choices: Sequence[Sequence[str]]) -> list[str]:
        complete = (choice for choice in choices if all(name in names for name in choice))
        return [names[name] for name in next(complete, ())]

    def take(chosen: Sequence[str]) -> NDArray:
        return _joined([columns.pop(name) for name in chosen])

    def native(name: str) -> NDArray:
        column = columns.pop(name)
        return column.astype(column.dtype.newbyteorder("="), copy=False)

    chosen = found(_POSITIONS)
    if not chosen:
        raise InputError(f"no x, y and z among the columns: {listed(columns)}")
    normals, colors, radii, ellipses = (
        found(choices) for choices in (_NORMALS, _COLORS, _RADII, [_ELLIPSES])
    )
    attributes: dict[str, Deferred] = {}
    if normals:
        attributes["normals"] = Deferred(lambda: take(normals), columns[normals[0]].dtype, 3)
    if colors:
        kind = columns[colors[0]].dtype
        attributes["colors"] = Deferred(lambda: _bytes_or_units(take(colors)), kind, len(colors))
    if radii:
        attributes["radii"] = Deferred(lambda: take(radii)[:, 0], columns[radii[0]].dtype)
    positions = [take(chosen)]
    if ellipses:
        axes, mean = _half_axes(take(ellipses))
        attributes.setdefault("radii", Deferred(lambda: mean, mean.dtype))
        attributes["axes"] = Deferred(lambda: axes, axes.dtype, 4)
    rest = columns.keys() - {*normals, *colors, *radii}
    scalars = {name: Deferred(partial(native, name), columns[name].dtype) for name in columns if name in rest}
    return cloud_of(positions, attributes, scalars, held=held, at_hand=True)


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
        (_ELLIPSES, None if cloud.axes is None else _as_ellipses(cloud.axes)),
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


def bounded_lines(stream: IO[AnyStr]) -> Iterator[AnyStr]:
    """The lines of a stream. Raises InputError where one is longer than any row of numbers."""
    for number, line in enumerate(stream, 1):
        if len(line) > LONGEST_LINE:
            raise InputError(f"line {number} has more than {LONGEST_LINE:,} characters")
        yield line


def parse_table(
    lines: Iterable[str],
    columns: Sequence[int] | None = None,
    delimiter: str | None = None,
    rows: int | None = None,
) -> NDArray[np.float64]:
    """Numbers from lines of text, (N, C) float64, as `numbers.parse_numbers` reads them.

    delimiter: between the values; None: blanks, or what `numbers.dialect_of` finds, decimal commas too.
    """
    if delimiter is None:
        dialect, lines = numbers.looked_at(lines, rows)
    else:
        dialect = numbers.Dialect(delimiter)
    return numbers.parse_numbers(lines, columns, dialect, rows)


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
    if name.lower() in _POSITIONS[0]:
        return column
    if dtype.kind in "iu":
        limits = np.iinfo(dtype)
        if not ((column >= limits.min) & (column <= limits.max)).all():
            return column
    return column.astype(dtype)


def _joined(columns: Sequence[NDArray]) -> NDArray:
    """(N, C) from C columns, without a copy where they lie side by side in one record."""
    first = columns[0]
    start, step = _address(first), first.itemsize
    side_by_side = all(
        (column.dtype, column.strides, _address(column)) == (first.dtype, first.strides, start + i * step)
        for i, column in enumerate(columns)
    )
    if side_by_side:
        return as_strided(first, (len(first), len(columns)), (first.strides[0], step), writeable=False)
    return np.stack(columns, axis=1)


def _address(array: NDArray) -> int:
    return array.__array_interface__["data"][0]


def _bytes_or_units(colors: NDArray) -> NDArray:
    """Colours as PointCloud takes them. Floats beyond 1 and small uint16 count in 0..255."""
    if colors.dtype.kind == "f" and np.nanmax(colors, initial=0) > 1:
        return _in_bytes(colors)
    if colors.dtype == np.uint16 and colors.max(initial=0) <= 255:
        return colors.astype(np.uint8)
    return colors


def _in_bytes(colors: NDArray) -> NDArray[np.uint8]:
    """Floats in 0..255 rounded; NaN: 0."""
    rounded = np.empty(colors.shape, np.uint8)
    for start in range(0, len(colors), _AT_ONCE):
        part = colors[start : start + _AT_ONCE]
        rounded[start : start + _AT_ONCE] = np.rint(np.clip(np.nan_to_num(part), 0, 255))
    return rounded


def _half_axes(ellipses: NDArray) -> tuple[NDArray, NDArray]:
    """Half-axes as PointCloud takes them, and radii of circles of the same area, from columns of _ELLIPSES.

    Tangents have any length; where one has none, neither has the half-axis.
    """
    dtype = np.result_type(ellipses.dtype, np.float32)
    axes, mean = np.empty((len(ellipses), 4), dtype), np.empty(len(ellipses), dtype)
    for start in range(0, len(ellipses), _AT_ONCE):
        rows = slice(start, start + _AT_ONCE)
        numbers = ellipses[rows].astype(dtype)
        lengths = np.where(numbers[:, :2] > 0, numbers[:, :2], 0)
        with np.errstate(over="ignore", invalid="ignore"):
            tangent_length = np.linalg.norm(numbers[:, 2:], axis=1, keepdims=True)
            unit = numbers[:, 2:] / np.where(tangent_length > 0, tangent_length, 1)
            axes[rows] = np.hstack([lengths[:, :1] * unit, lengths[:, 1:]])
            mean[rows] = np.sqrt(lengths.prod(axis=1))
    return axes, mean


def _as_ellipses(axes: NDArray[np.float32]) -> NDArray[np.float32]:
    """The columns of _ELLIPSES, (N, 5); zeros where a splat is round."""
    length = np.linalg.norm(axes[:, :3], axis=1, keepdims=True)
    return np.hstack([length, axes[:, 3:], axes[:, :3] / np.where(length > 0, length, 1)])


def _absolute(cloud: PointCloud, slack: float) -> NDArray[np.float32] | NDArray[np.float64]:
    if not cloud.origin.any() and cloud.remainders is None:
        return cloud.positions
    world = cloud.world()
    single = world.astype(np.float32)
    return single if is_enough(single, world, slack) else world
