"""One array in NumPy's own format, of which a single frame can be read."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from io import BytesIO
from threading import RLock
from typing import IO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ...errors import InputError
from ..contents import PointContents
from ..reading.columns import decide as decide_columns
from ..reading.columns import names_of
from ..reading.sequence import Decided
from ._columns import named

_CHUNK = 1 << 22  # bytes read at a time, so that a packed stream needs no second copy
_LONGEST_HEADER = 10_000  # bytes, as numpy has it
QUIETLY = RLock()  # around what turns warnings off, which does so for all threads


@dataclass(frozen=True)
class StoredArray:
    """An array whose header is read and whose values are not.

    stream stands behind the header; size: bytes from there to the end, as the container says.
    moved: which axis of the file, from the end, is the last one of `shape`: 2 or 3; 0: none is moved.
    """

    name: str
    stream: IO[bytes]
    shape: tuple[int, ...]
    dtype: np.dtype
    column_order: bool
    size: int
    moved: int = 0

    @classmethod
    def open(cls, name: str, stream: IO[bytes], size: int) -> StoredArray:
        """Read the header; size: bytes of header and values.

        Raises InputError, also where it promises more than is held, or ValueError.
        """
        headers = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
        version = npy.read_magic(stream)
        if version not in headers:
            raise InputError(f"array '{name}' has the format version {version}, which Scan4D does not read")
        head = stream.read(2 * version[0])
        length = int.from_bytes(head, "little")
        if length > _LONGEST_HEADER:
            raise InputError(f"array '{name}' has a header of {length:,} bytes, which is too long")
        header = BytesIO(head + stream.read(length))
        # numpy warns of headers written by Python 2.
        with QUIETLY, warnings.catch_warnings(action="ignore"):
            shape, column_order, dtype = headers[version](header)
        array = cls(name, stream, shape, dtype, column_order, size - stream.tell())
        if not dtype.hasobject and (min(shape, default=0) < 0 or array.nbytes > array.size):
            raise InputError(f"array '{name}' should contain {array.nbytes} bytes, but contains {array.size}")
        return array

    @property
    def _is_whole(self) -> bool:
        """Whether entries along the first axis do not lie one behind the other."""
        return self.column_order or self.moved == len(self.shape)

    @property
    def nbytes(self) -> int:
        """Bytes of all values."""
        return math.prod(self.shape) * self.dtype.itemsize

    def reshaped(self, shape: tuple[int, ...]) -> StoredArray:
        """Return the same values in another shape, which has the same axes but for those of length 1."""
        return replace(self, shape=shape)

    def with_last(self, axis: int) -> StoredArray:
        """Return the same values with an axis, the second or third one from the end, moved to the end."""
        shape = [*self.shape]
        shape.append(shape.pop(-axis))
        return replace(self, shape=tuple(shape), moved=axis)

    def memory(self, frame: int | None = None) -> int:
        """Bytes that `read` takes."""
        is_part = frame is not None and not self._is_whole
        return math.prod(self.shape[1:] if is_part else self.shape) * self.dtype.itemsize

    def read(self, frame: int | None = None) -> NDArray:
        """The whole array, or one entry along its first axis. To be called once.

        Raises InputError for pickled objects and where the stream ends early.
        """
        self._check_type()
        if frame is None:
            return self._values(self.shape)
        if self._is_whole:
            return self._values(self.shape)[frame].copy()
        shape = self.shape[1:]
        self.stream.seek(frame * math.prod(shape) * self.dtype.itemsize, 1)
        return self._values(shape)

    def first(self, count: int) -> NDArray:
        """The first entries along the first axis; `read` still works then. Raises InputError as `read`."""
        self._check_type()
        at = self.stream.tell()
        whole = self._is_whole or count >= self.shape[0]
        values = self._values(self.shape if whole else (count, *self.shape[1:]))[:count]
        self.stream.seek(at)
        return values

    def _check_type(self) -> None:
        if self.dtype.hasobject:
            raise InputError(
                f"array '{self.name}' contains pickled Python objects, which Scan4D does not read for safety"
            )

    def _values(self, shape: tuple[int, ...]) -> NDArray:
        if not self.moved:
            return self._as_stored(shape)
        stored = [*shape]
        stored.insert(len(shape) - self.moved, stored.pop())
        return np.moveaxis(self._as_stored(tuple(stored)), -self.moved, -1)

    def _as_stored(self, shape: tuple[int, ...]) -> NDArray:
        flat = np.empty(math.prod(shape) * self.dtype.itemsize, np.uint8)
        for start in range(0, flat.size, _CHUNK):
            part = flat[start : start + _CHUNK]
            if self.stream.readinto(part) != part.size:  # type: ignore[attr-defined]
                raise InputError(f"array '{self.name}' is not complete")
        values = flat.view(self.dtype)
        return values.reshape(shape[::-1]).T if self.column_order else values.reshape(shape)


def rows_of_points(values: NDArray) -> NDArray:
    """Points (N, 3) of any array whose last axis is x, y and z, at least in single precision."""
    points = values.reshape(-1, 3)
    return points.astype(np.float32) if points.dtype.itemsize < 4 and points.dtype.kind == "f" else points


def columns_of_array(values: NDArray, held: int, decided: Decided) -> PointContents:
    """The columns of points (…, C), or of an array of fields, by name. Raises InputError."""
    if values.dtype.names is not None:
        return PointContents(columns=named(_fields(values.ravel())), held=held)
    values = values.reshape(-1, values.shape[-1])
    table = values.astype(np.float64, copy=False)
    roles = decide_columns(table, corrections=decided.corrections)
    decided.note(roles)
    columns = dict(zip(names_of(roles.value), values.T, strict=True))
    return PointContents(
        columns=columns, is_named=False, has_roles="columns" in decided.corrections, held=held
    )


def _fields(values: NDArray) -> Iterator[tuple[str, NDArray]]:
    """The columns of an array of fields (N,); those of a field with several numbers are called `NAME_0`."""
    for name in values.dtype.names or ():
        column = values[name]
        if column.ndim == 1:
            yield name, column
        elif column.ndim == 2:
            yield from ((f"{name}_{at}", column[:, at]) for at in range(column.shape[1]))
