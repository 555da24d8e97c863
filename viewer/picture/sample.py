"""Sample: some rows of a pose in place of all, for a preview while it moves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..gpu import gl
from ..gpu.context import Gpu

_GROWTH = 1.125  # so that poses a little larger than the last ones need no new list
_CHUNK = 1 << 20  # rows looked at at a time


def is_sampled(rows: NDArray[np.uint32], share: float) -> NDArray[np.bool_]:
    """Whether a sample of this share takes each of the rows, (N,): (N,).

    All rows there can be stand in one shuffled order, and a sample is its beginning: a larger
    share takes what a smaller one takes, and a row's lot depends on nothing but its number.
    The order is van der Corput's, scrambled: of any 2^k rows in a run, beginning at a multiple
    of 2^k, it takes that share. Rows of a scan that follow one another lie side by side as a
    rule, so that the gaps are much more even than by lot.
    """
    return lots(rows) < share * 2.0**32


def lots(rows: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """The index of each row, (N,), in the shuffled order of all there can be: (N,)."""
    return _scrambled(_reversed_bits(rows))


def _scrambled(x: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Bits changed by chance, each by those below it alone (Laine and Karras 2011, 4.1)."""
    x = x ^ x * np.uint32(0x3D20ADEA)
    x = (x + np.uint32(0x9E3779B9)) * np.uint32(0x85EBCA6B)
    x = x ^ x * np.uint32(0x05526C56)
    return x ^ x * np.uint32(0x53A22864)


def _reversed_bits(x: NDArray[np.uint32]) -> NDArray[np.uint32]:
    for bits, low in ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF), (16, 0x0000FFFF)):
        mask, shift = np.uint32(low), np.uint32(bits)
        x = ((x >> shift) & mask) | ((x & mask) << shift)
    return x


class Sample:
    """The sampled rows as texels, ascending: one list, for the share asked for last and the largest pose.

    Ascending, so that what is drawn in that order resolves ties to the lowest row as usual. It takes
    4 bytes a row, an eighth of what a point of a pose usually takes.
    """

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._share = 0.0
        self._reach = 0  # rows below it have been looked at
        self._rows = np.empty(0, np.uint32)
        self._texels: gl.BufferTexture | None = None

    def take(self, share: float, count: int) -> tuple[gl.BufferTexture, int]:
        """The list, and how many of its rows are those of a pose of `count` points."""
        if self._texels is None or share != self._share or count > self._reach:
            self._gpu.discard(self._texels)
            self._share, self._reach = share, int(count * _GROWTH)
            self._rows = _sampled_rows(self._reach, share)
            texels = self._rows if self._rows.size else bytes(4)  # a buffer of no bytes is not allowed
            self._texels = gl.BufferTexture(self._gpu.buffer(texels), gl.R32UI)
        return self._texels, int(np.searchsorted(self._rows, count))


def sample_of(gpu: Gpu) -> Sample:
    """The sample that all backends on this context share."""
    return gpu.cached(Sample)


class RowList:
    """Rows as texels, one list at a time."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._capacity = 0
        self._rows: NDArray[np.uint32] | None = None
        self._texels: gl.BufferTexture | None = None

    def write(self, rows: NDArray[np.uint32]) -> gl.BufferTexture:
        """The list, made of these rows, (N,)."""
        if self._texels is None or len(rows) > self._capacity:
            self._gpu.discard(self._texels)
            self._capacity = max(int(len(rows) * _GROWTH), 1)  # a buffer of no bytes is not allowed
            self._texels = gl.BufferTexture(self._gpu.buffer(reserve=4 * self._capacity), gl.R32UI)
        if rows is not self._rows and len(rows):
            self._texels.buffer.write(rows)
        self._rows = rows
        return self._texels


def row_list(gpu: Gpu) -> RowList:
    """The list of rows in view that all backends on this context share."""
    return gpu.cached(RowList)


def _sampled_rows(count: int, share: float) -> NDArray[np.uint32]:
    starts = range(0, count, _CHUNK)
    chunks = (np.arange(start, min(start + _CHUNK, count), dtype=np.uint32) for start in starts)
    return np.concatenate([rows[is_sampled(rows, share)] for rows in chunks])
