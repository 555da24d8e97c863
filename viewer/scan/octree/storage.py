"""Octrees as bytes: a header that says what follows, then the levels, the coarsest first.

Whatever ends behind a level is the coarser tree. docs/octree-files.md has the layout.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..points import UNKNOWN_UNIT
from . import coding
from .coding import Bytes, MaskCoder
from .octree import DEEPEST, Attributes, Octree

MAGIC = b"\x8dSVO"
VERSION = 1
_FREE = 1 << 22  # nodes of any tree: some 300 MB as points
MOST_BEFORE = 255  # trees that have to be read before one

_PACKED, _COLORS, _NORMALS = 1, 2, 4  # bits of `Header.flags`
_FIXED = struct.Struct("<4s6BI5d2Q")  # magic, version, flags, before, depth, size of the unit, 0; numbers
_LEVEL = struct.Struct("<4I")  # see `Level`
_CHECK = struct.Struct("<I")  # CRC-32 of the header before it
_MOST_UNIT = 255  # bytes
_WORTH = 31 / 32  # of the bytes of masks that stand alone: what takes more is not told by another tree
_LARGEST = 1e18  # coordinates that a cloud may have
LARGEST_HEADER = _FIXED.size + _MOST_UNIT + (DEEPEST + 1) * _LEVEL.size + _CHECK.size  # bytes


@dataclass(frozen=True)
class Level:
    """The entry of a level in a header: its nodes, bytes of masks and of attributes, CRC-32 of both.

    The masks are those of the level above, which tell where these nodes are.
    """

    nodes: int
    masks: int
    attributes: int
    check: int


@dataclass(frozen=True, eq=False)
class Header:
    """The header of a tree, which stands before its levels.

    flags: 1: packed, 2: with colours, 4: with normals. before: how many trees have to be read before this
    one, each told by the one before it; 0: it stands alone. told: bit n: the masks of level n are told by the
    tree before. time: seconds. Others: see `Octree`.
    """

    flags: int
    before: int
    told: int
    time: float
    low: NDArray[np.float64]
    edge: float
    points: int
    distinct: int
    unit: str
    levels: tuple[Level, ...]

    @property
    def stored(self) -> int:
        """How many bytes the levels take."""
        return sum(level.masks + level.attributes for level in self.levels)

    @property
    def width(self) -> int:
        """Bytes of attributes for a node."""
        return 4 * bool(self.flags & _COLORS) + 2 * bool(self.flags & _NORMALS)

    def to_bytes(self) -> bytes:
        """The bytes that stand before the levels."""
        unit = self.unit.encode()
        kind = (MAGIC, VERSION, self.flags, self.before, len(self.levels) - 1, len(unit), 0)
        place = (self.told, self.time, *self.low.tolist(), self.edge, self.points, self.distinct)
        levels = (_LEVEL.pack(each.nodes, each.masks, each.attributes, each.check) for each in self.levels)
        data = _FIXED.pack(*kind, *place) + unit + b"".join(levels)
        return data + _CHECK.pack(zlib.crc32(data))


def to_bytes(
    octree: Octree,
    previous: Octree | None = None,
    *,
    chain: int = 1,
    time: float = 0.0,
    unit: str = UNKNOWN_UNIT,
    packed: bool = True,
) -> bytes:
    """A tree with its colours and normals; also what a file of one pose holds.

    Geometry and colours come back bit for bit, normals to a degree, cones and rows not at all.
    previous: the tree of the pose before. Where it has the same cube, and that saves more than a 32nd of the
    masks, those of the levels that get shorter are told by it, and it is needed to read them. chain: how many
    trees have to be read for it, itself included. packed: False stores the masks as they are, breadth-first.
    Raises InputError where the name of the unit or the tree is larger than the header can say.
    """
    if len(unit.encode()) > _MOST_UNIT or octree.counts.max() >> 31:
        raise InputError(
            f"an octree is stored with a unit of {_MOST_UNIT} bytes and 2^31 nodes a level at most"
        )
    can_tell = packed and previous is not None and chain <= MOST_BEFORE and _same_cube(octree, previous)
    masks, told = _store_masks(octree, previous if can_tell else None, packed)
    blocks = list(zip([b"", *masks], _store_attributes(octree), strict=True))
    levels = tuple(
        Level(int(nodes), len(above), len(own), zlib.crc32(above + own))
        for nodes, (above, own) in zip(octree.counts, blocks, strict=True)
    )
    kind = (_PACKED * packed | _kinds(octree), chain if told else 0, told)
    cube = (octree.low, octree.edge)
    header = Header(*kind, time, *cube, octree.points, octree.distinct, unit, levels)
    if packed and _are_too_many(int(octree.counts.sum()), header.stored):
        return to_bytes(octree, time=time, unit=unit, packed=False)
    return header.to_bytes() + b"".join(above + own for above, own in blocks)


def from_bytes(
    data: bytes, previous: Octree | None = None, attributes: bool = True, leaves_only: bool = False
) -> Octree:
    """The tree of `to_bytes`; the coarser one where the bytes end behind one of its levels.

    previous: the tree before, where the header says that it takes one. attributes: False leaves them out.
    leaves_only: those of levels without a leaf are empty arrays.
    Raises InputError where bytes are missing or damaged.
    """
    header, size = read_header(data)
    whole = [level.nodes for level, _ in zip(header.levels, _whole_levels(header, data[size:]), strict=False)]
    if _are_too_many(sum(whole), len(data)):
        raise InputError(f"says that {len(data):,} bytes hold {sum(whole):,} octants, which is too many")
    if header.before and (previous is None or not _same_cube(header, previous)):
        raise InputError("is told by the octree before it, which is missing")
    told = previous.masks if header.before and previous is not None else ()
    coder = MaskCoder(header.levels[0].nodes, told)
    masks: list[Bytes] = []
    found: list[Attributes] = []
    values: Bytes | None = None
    for level, (above, own) in zip(header.levels, _whole_levels(header, data[size:]), strict=False):
        if level is not header.levels[0]:
            masks.append(_read_masks(above, header, coder, len(masks)))
        if attributes and header.width:
            below = _read_attributes(own, header.width, masks, values)
            if values is not None:
                shown = not leaves_only or (masks[-1] == 0).any()
                found.append(_attributes(values if shown else values[:0], header.flags))
            values = below
    if values is not None:
        found.append(_attributes(values, header.flags))
    return Octree(header.low, header.edge, tuple(masks), header.points, header.distinct, tuple(found))


def read_header(data: bytes) -> tuple[Header, int]:
    """The header at the beginning of the bytes, and its size. Raises InputError where it is none."""
    if not data.startswith(MAGIC):
        raise InputError("an octree is missing where one should begin")
    if len(data) < _FIXED.size:
        raise InputError("ends within the header of an octree")
    _, version, flags, before, depth, unit_size, _, *place = _FIXED.unpack_from(data)
    if version != VERSION:
        raise InputError(f"holds octrees of version {version}", hint=f"This Scan4D reads version {VERSION}")
    start = _FIXED.size + unit_size
    end = start + (depth + 1) * _LEVEL.size
    if len(data) < end + _CHECK.size:
        raise InputError("ends within the header of an octree")
    if _CHECK.unpack_from(data, end)[0] != zlib.crc32(data[:end]):
        raise InputError("the header of an octree is damaged")
    levels = tuple(Level(*values) for values in _LEVEL.iter_unpack(data[start:end]))
    told, time, x, y, z, edge, points, distinct = place
    unit = data[_FIXED.size : start].decode(errors="replace")
    low = np.array([x, y, z])
    header = Header(flags, before, told, time, low, edge, points, distinct, unit, levels)
    if not _is_possible(header):
        raise InputError("the header of an octree contradicts itself")
    return header, end + _CHECK.size


def _is_possible(header: Header) -> bool:
    nodes = [level.nodes for level in header.levels]
    return bool(
        len(nodes) <= DEEPEST + 1
        and np.isfinite(header.time)
        and (np.abs(header.low) < _LARGEST).all()
        and 0 < header.edge < _LARGEST
        and max(nodes) <= header.distinct <= header.points
        and nodes[0] == min(header.points, 1)
        and all(0 < below <= 8 * above for above, below in pairwise(nodes))
        and header.levels[0].masks == 0
        and (header.before > 0) == (header.told > 0)
    )


def _are_too_many(nodes: int, stored: int) -> bool:
    """Whether nodes would take far more memory than what is stored of them: such trees are stored as they
    are, and bytes that promise one are refused."""
    return nodes > max(_FREE, coding.MOST_RATIO * stored)


def _same_cube(one: Octree | Header, other: Octree) -> bool:
    return one.edge == other.edge and bool((one.low == other.low).all())


def _whole_levels(header: Header, data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Stored bytes of each level, masks and attributes, as far as there are any."""
    at = 0
    for number, level in enumerate(header.levels):
        if at == len(data) and number:
            return
        middle, end = at + level.masks, at + level.masks + level.attributes
        if end > len(data):
            raise InputError(f"ends within level {number} of an octree's {len(header.levels) - 1}")
        if zlib.crc32(data[at:end]) != level.check:
            raise InputError(f"level {number} of an octree is damaged")
        yield data[at:middle], data[middle:end]
        at = end


# --- masks ----------------------------------------------------------------------------


def _store_masks(octree: Octree, previous: Octree | None, packed: bool) -> tuple[list[bytes], int]:
    """Stored masks of each level above the deepest; bit n: level n is told by the tree before."""
    if not packed:
        return [masks.tobytes() for masks in octree.masks], 0
    coder = MaskCoder(int(octree.counts[0]), previous.masks if previous else ())
    alone, shorter = [], []
    for masks in octree.masks:
        alone.append(coding.pack(coder.sort(masks, told=False)))
        other = coding.pack(coder.sort(masks, told=True)) if previous else alone[-1]
        shorter.append(min(alone[-1], other, key=len))
        coder.descend(masks)
    if sum(map(len, shorter)) > _WORTH * sum(map(len, alone)):
        return alone, 0
    told = [len(one) < len(other) for one, other in zip(shorter, alone, strict=True)]
    return shorter, sum(1 << level for level, is_told in enumerate(told) if is_told)


def _read_masks(stored: bytes, header: Header, coder: MaskCoder, level: int) -> Bytes:
    """The masks of a level, whose nodes below are as many as the header says."""
    masks = coding.unpack(stored, header.levels[level].nodes)
    if header.flags & _PACKED:
        masks = coder.restore(masks, told=bool(header.told >> level & 1))
        if level + 2 < len(header.levels):
            coder.descend(masks)
    if np.bitwise_count(masks).sum(dtype=np.int64) != header.levels[level + 1].nodes:
        raise InputError(f"level {level + 1} of an octree has not as many nodes as its header says")
    return masks


# --- attributes -------------------------------------------------------------------------


def _kinds(octree: Octree) -> int:
    """The flags of the attributes that a tree has."""
    if not octree.attributes:
        return 0
    root = octree.attributes[0]
    return _COLORS * (root.colors is not None) | _NORMALS * (root.normals is not None)


def _store_attributes(octree: Octree) -> list[bytes]:
    if not _kinds(octree):
        return [b""] * (octree.depth + 1)
    values = [_bytes(each) for each in octree.attributes]
    told = [coding.differences(below, above, masks)
            for above, below, masks in zip(values, values[1:], octree.masks, strict=False)]  # fmt: skip
    return [coding.pack(each) for each in (values[0].ravel(), *told)]


def _bytes(attributes: Attributes) -> Bytes:
    """(n, k) bytes of a level's colours and normals."""
    parts = []
    if attributes.colors is not None:
        parts.append(coding.color_bytes(attributes.colors))
    if attributes.normals is not None:
        parts.append(coding.normal_bytes(attributes.normals))
    return np.concatenate(parts, axis=1)


def _read_attributes(stored: bytes, width: int, masks: list[Bytes], above: Bytes | None) -> Bytes:
    """(n, k) bytes of the next level. masks: of the levels above. above: the bytes of the last of them."""
    if above is None:
        return coding.unpack(stored, width).reshape(1, -1)
    size = width * coding.sibling_count(masks[-1])
    return coding.restored(coding.unpack(stored, size), above, masks[-1])


def _attributes(values: Bytes, flags: int) -> Attributes:
    return Attributes(
        colors=coding.colors_of(values[:, :4]) if flags & _COLORS else None,
        normals=coding.normals_of(values[:, -2:]) if flags & _NORMALS else None,
    )
