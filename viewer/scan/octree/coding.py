"""What the nodes of a tree show as few bytes: differences, then LZMA.

Attributes are stored as differences from the parent's, or from those of the same octant in the tree before.
"""

from __future__ import annotations

import lzma
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .octree import Bytes, Nodes

MOST_RATIO = 64  # of unpacked to packed: what packs better stays as it is, so that a file cannot promise more
_LZMA = {
    "id": lzma.FILTER_LZMA1,
    "preset": 6,
    "dict_size": 1 << 20,
    **{"lc": 0, "lp": 0, "pb": 0},  # a byte tells nothing of the next, nor does where it stands
}


def pack(values: Bytes, most: int = MOST_RATIO) -> bytes:
    """Pack bytes as LZMA without a header; as they are where that is not shorter, or beyond a ratio."""
    plain = values.tobytes()
    packed = lzma.compress(plain, format=lzma.FORMAT_RAW, filters=[_LZMA])
    return packed if len(plain) <= most * len(packed) and len(packed) < len(plain) else plain


def unpack(block: bytes, size: int, most: int = MOST_RATIO) -> Bytes:
    """The bytes that `pack` was given, as many as there were. Raises InputError where they are others."""
    if len(block) == size:
        return np.frombuffer(block, np.uint8)
    if size > most * len(block):
        raise InputError(
            f"a block of {len(block)} bytes would unpack to {size} bytes, which is suspiciously much"
        )
    try:
        plain = lzma.LZMADecompressor(lzma.FORMAT_RAW, filters=[_LZMA]).decompress(block, size)
    except lzma.LZMAError as error:
        raise InputError("a level cannot be unpacked") from error
    if len(plain) != size:
        raise InputError(f"a level has {len(plain)} bytes instead of {size}")
    return np.frombuffer(plain, np.uint8)


# --- attributes -------------------------------------------------------------------------

_RADIUS_STEPS = 10  # of a radius, for each factor of two
_RADIUS_OF_EDGE = 221  # the byte of a radius that is the edge of the cube
_ROUNDING = 1e-3  # steps; so that the bytes of `radii_of` are its own


class Counterparts(NamedTuple):
    """Attributes of a level as the tree before tells them. nodes: (n,) the same octants there, -1 for none.
    values: the bytes of all octants there, (m, k)."""

    nodes: Nodes
    values: Bytes


def differences(values: Bytes, above: Bytes, masks: Bytes, before: Counterparts | None = None) -> Bytes:
    """Differences that are stored of (n, k) bytes of a level, by columns: of siblings from their parents; or
    first of those with a counterpart from that, then of the others from their parents.

    above: (m, k), the parents'. masks: (m,). An only child has the points of its parent and so
    its values, which are not stored.
    """
    expected, stored = _expected(above, masks, before)
    return (values[stored] - expected[stored]).T.ravel()


def restored(stored: Bytes, above: Bytes, masks: Bytes, before: Counterparts | None = None) -> Bytes:
    """(n, k) bytes of a level from their `differences`."""
    from .attribute_kernels import add

    values, rows = _expected(above, masks, before)
    add(values, rows, np.array(stored.reshape(above.shape[1], -1)))  # compiled code takes none read-only
    return values


def _expected(above: Bytes, masks: Bytes, before: Counterparts | None) -> tuple[Bytes, Nodes]:
    """Bytes expected of a level, (n, k), and the nodes of which differences are stored, in their order."""
    from .attribute_kernels import expect

    nodes, values = before or Counterparts(np.empty(0, np.int32), above[:0])
    count = int(np.bitwise_count(masks).sum(dtype=np.int64))
    expected = np.empty((count, above.shape[1]), np.uint8)
    stored = np.empty(sibling_count(masks), np.int32)
    expect(np.array(above), np.array(masks), nodes, np.array(values), expected, stored)
    return expected, stored


def sibling_count(masks: Bytes) -> int:
    """How many nodes below are not the only child."""
    counts = np.bitwise_count(masks)
    return int(counts[counts > 1].sum(dtype=np.int64))


def color_bytes(colors: Bytes) -> Bytes:
    """(n, 4): green, red and blue less green (modulo 256), and alpha; of red, green, blue, alpha."""
    red, green, blue, alpha = colors.T
    return np.stack([green, red - green, blue - green, alpha], axis=1)


def colors_of(stored: Bytes) -> Bytes:
    """(n, 4) colours of their `color_bytes`."""
    green, red, blue, alpha = stored.T
    return np.stack([red + green, green, blue + green, alpha], axis=1)


def radius_bytes(radii: NDArray[np.float32], edge: float) -> Bytes:
    """(n, 1): distances in steps of a tenth of a factor of two, rounded up, of an edge; 0 stands for none."""
    steps = np.log2(np.maximum(radii, np.float32(1e-30)) / np.float64(edge)) * _RADIUS_STEPS + _RADIUS_OF_EDGE
    found = np.clip(np.ceil(steps - _ROUNDING), 1, 255).astype(np.uint8)
    return np.where(radii > 0, found, np.uint8(0))[:, None]


def radii_of(stored: Bytes, edge: float) -> NDArray[np.float32]:
    """(n,) distances of their `radius_bytes`, which are (n,)."""
    steps = (np.arange(256) - _RADIUS_OF_EDGE) / _RADIUS_STEPS
    table = np.where(np.arange(256) > 0, edge * np.exp2(steps), 0).astype(np.float32)
    return table[stored]


def normal_bytes(normals: NDArray[np.float32]) -> Bytes:
    """(n, 2): unit normals on the octahedron unfolded into a square of 255 x 255 cells, to a degree.

    1..255 along each side; 0, 0 stands for no normal. Of cells at the rim that stand for one direction, one
    is taken, so that these are the bytes of their own `normals_of`. Cigolle et al. 2014, A Survey of
    Efficient Representations for Independent Unit Vectors.
    """
    return _one_of_each()[_cells(normals)]


def _cells(normals: NDArray[np.float32]) -> NDArray[np.uint16]:
    """(n,): 256 times the first byte and the second of each normal."""
    from .attribute_kernels import cells_of

    cells = np.empty(len(normals), np.uint16)
    cells_of(np.array(normals), cells)
    return cells


def normals_of(stored: Bytes) -> NDArray[np.float32]:
    """(n, 3) float32 normals of their `normal_bytes`; 0 where there is none."""
    return _normals()[stored[:, 0].astype(np.uint16) << np.uint16(8) | stored[:, 1]]


@cache
def _one_of_each() -> Bytes:
    """(65536, 2): of each pair of bytes those that stand for its direction, which are their own."""
    ones = _cells(_normals())
    for _ in range(2):
        ones = _cells(_normals()[ones])
    return np.stack([ones >> 8, ones & 255], axis=1).astype(np.uint8)


@cache
def _normals() -> NDArray[np.float32]:
    """(65536, 3): the normal of each pair of bytes."""
    x, y = (np.indices((256, 256)).reshape(2, -1) - 128) / 127
    z = 1 - np.abs(x) - np.abs(y)
    fold = np.maximum(-z, 0)
    normals = np.stack([x - np.where(x < 0, -fold, fold), y - np.where(y < 0, -fold, fold), z], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals[0] = 0
    return normals.astype(np.float32)
