"""One array in NumPy's own format, of which a single frame can be read."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import IO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ...errors import InputError

_CHUNK = 1 << 24  # bytes read at a time, so that a packed stream needs no second copy


@dataclass(frozen=True)
class StoredArray:
    """An array whose header is read and whose values are not.

    stream stands behind the header; size: bytes from there to the end, as the container says.
    """

    name: str
    stream: IO[bytes]
    shape: tuple[int, ...]
    dtype: np.dtype
    column_order: bool
    size: int

    @classmethod
    def open(cls, name: str, stream: IO[bytes], size: int) -> StoredArray:
        """Read the header; size: bytes of header and values. Raises InputError or ValueError."""
        headers = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
        version = npy.read_magic(stream)
        if version not in headers:
            raise InputError(f"array '{name}' has format version {version}")
        shape, column_order, dtype = headers[version](stream)
        return cls(name, stream, shape, dtype, column_order, size - stream.tell())

    @property
    def sequence(self) -> tuple[int, ...]:
        """Of positions: (T,) where they are (T, N, 3), () where they are (N, 3). Else raises InputError."""
        if len(self.shape) not in (2, 3) or self.shape[-1] != 3:
            raise InputError(
                f"array '{self.name}' has shape {self.shape}", hint="Positions are (N, 3) or (T, N, 3)"
            )
        return self.shape[:-2]

    def read(self, frame: int | None = None) -> NDArray:
        """The whole array, or one entry along its first axis. To be called once.

        Raises InputError for pickled objects and where the header promises more than is held.
        """
        if self.dtype.hasobject:
            raise InputError(f"array '{self.name}' holds pickled objects, which are refused")
        promised = math.prod(self.shape) * self.dtype.itemsize
        if promised > self.size or min(self.shape, default=0) < 0:
            raise InputError(f"array '{self.name}' promises {promised} bytes and holds {self.size}")
        if frame is None:
            return self._values(self.shape)
        if self.column_order:
            return self._values(self.shape)[frame]
        shape = self.shape[1:]
        self.stream.seek(frame * math.prod(shape) * self.dtype.itemsize, 1)
        return self._values(shape)

    def _values(self, shape: tuple[int, ...]) -> NDArray:
        flat = np.empty(math.prod(shape) * self.dtype.itemsize, np.uint8)
        for start in range(0, flat.size, _CHUNK):
            part = flat[start : start + _CHUNK]
            if self.stream.readinto(part) != part.size:  # type: ignore[attr-defined]
                raise InputError(f"array '{self.name}' ends early")
        values = flat.view(self.dtype)
        return values.reshape(shape[::-1]).T if self.column_order else values.reshape(shape)
