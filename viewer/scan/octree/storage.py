"""Octrees as bytes: a header that says what follows, points outside, then the levels, the coarsest first.

Whatever ends behind a level is the coarser tree. docs/reference/octree-files.md has the layout.
"""

from __future__ import annotations

import itertools
import struct
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..points import UNKNOWN_UNIT, PointCloud
from . import coding
from .coding import Counterparts
from .occupancy import OccupancyCoder
from .octree import DEEPEST, Attributes, Bytes, Nodes, Octree

MAGIC = b"\x8dSVO"
VERSION = 5
_FREE = 1 << 22  # nodes of any tree: some 300 MB as points
MOST_BEFORE = 255  # trees that have to be read before one

_PACKED, _COLORS, _NORMALS, _RADII = 1, 2, 4, 8  # bits of `Header.flags`
_FIXED = struct.Struct("<4s6BI5d2Q5I")  # magic, version, flags, before, depth, size of the unit, 0; numbers
_LEVEL = struct.Struct("<4I")  # see `Level`
_CHECK = struct.Struct("<I")  # CRC-32 of the header before it
_MOST_UNIT = 255  # bytes
_WORTH = 31 / 32  # of the bytes of masks that stand alone: what takes more is not predicted from another tree
_OF_ATTRIBUTES = 1 << 12  # of unpacked to packed: how many nodes there are is bounded by their masks
_LARGEST = 1e18  # coordinates that a cloud may have
LARGEST_HEADER = _FIXED.size + _MOST_UNIT + (DEEPEST + 1) * _LEVEL.size + _CHECK.size  # bytes


@dataclass(frozen=True)
class Level:
    """The entry of a level in a header: its nodes, bytes of masks and of attributes, CRC-32 of both.

    The masks are those of the level above, which tell where these nodes are. Of strays, positions stand in
    the place of masks.
    """

    nodes: int
    masks: int
    attributes: int
    check: int


_NO_STRAYS = Level(0, 0, 0, 0)


class CutShort(InputError):
    """Bytes that end within the header of an octree."""


@dataclass(frozen=True, eq=False)
class Strays:
    """Points outside an octree's cube. positions: (s, 3) float64, absolute; colors: (s, 4) uint8, normals:
    (s, 3) float32, radii: (s,) float32, 0: unknown, or None, as those of the octree."""

    positions: NDArray[np.float64]
    colors: Bytes | None = None
    normals: NDArray[np.float32] | None = None
    radii: NDArray[np.float32] | None = None

    @classmethod
    def of(cls, octree: Octree, cloud: PointCloud) -> Strays:
        """The strays of the octree of a cloud."""
        rows = octree.strays
        of_nodes = octree.attributes[0] if octree.attributes else Attributes()
        radii = None
        if of_nodes.own_radii is not None and cloud.radii is not None:
            own = cloud.radii[rows]
            radii = np.where((own > 0) & (own < np.inf), own, np.float32(0))
        return cls(
            cloud.world(rows),
            None if of_nodes.colors is None or cloud.colors is None else cloud.colors[rows],
            None if of_nodes.normals is None or cloud.normals is None else cloud.normals[rows],
            radii,
        )

    def __len__(self) -> int:
        return len(self.positions)


@dataclass(frozen=True, eq=False)
class Header:
    """The header of a tree, which stands before its levels.

    flags: 1: packed, 2: with colours, 4: with normals, 8: with radii. before: how many trees have to be
    read before this one, each predicted from the one before it; 0: it stands alone. predicted: bit n: the
    masks of level n are predicted from the tree before; predicted_attributes: its attributes are. time:
    seconds. strays: their entry. Others: see `Octree`.
    """

    flags: int
    before: int
    predicted: int
    time: float
    low: NDArray[np.float64]
    edge: float
    points: int
    distinct: int
    unit: str
    levels: tuple[Level, ...]
    predicted_attributes: int = 0
    strays: Level = _NO_STRAYS

    @property
    def stored(self) -> int:
        """How many bytes the strays and the levels take."""
        return sum(level.masks + level.attributes for level in (self.strays, *self.levels))

    @property
    def width(self) -> int:
        """Bytes of attributes for a node."""
        return 4 * bool(self.flags & _COLORS) + 2 * bool(self.flags & _NORMALS) + bool(self.flags & _RADII)

    def to_bytes(self) -> bytes:
        """The bytes that stand before the levels."""
        unit = self.unit.encode()
        kind = (MAGIC, VERSION, self.flags, self.before, len(self.levels) - 1, len(unit), 0)
        place = (self.predicted, self.time, *self.low.tolist(), self.edge, self.points, self.distinct)
        others = self.predicted_attributes, *astuple(self.strays)
        levels = (_LEVEL.pack(*astuple(each)) for each in self.levels)
        data = _FIXED.pack(*kind, *place, *others) + unit + b"".join(levels)
        return data + _CHECK.pack(zlib.crc32(data))


def to_bytes(
    octree: Octree,
    previous: Octree | None = None,
    *,
    chain: int = 1,
    time: float = 0.0,
    unit: str = UNKNOWN_UNIT,
    packed: bool = True,
    strays: Strays | None = None,
) -> bytes:
    """A tree with its colours, normals and radii; also what a file of one pose holds.

    Geometry and colours come back bit for bit, normals to a degree, radii up to 7 % larger, cones and rows
    not at all.
    previous: the tree of the pose before. Where it has the same cube, and that saves more than a 32nd of the
    bytes, masks and attributes of the levels that get shorter are predicted from it. Reading them needs it.
    chain: how many trees have to be read for it, itself included. packed: False stores the masks as they are,
    breadth-first. strays: the points outside, which are left out where they are not given.
    Raises InputError where the name of the unit or the tree is larger than the header can say.
    """
    if len(unit.encode()) > _MOST_UNIT or octree.counts.max() >> 31:
        raise InputError(
            f"an octree file can store at most {_MOST_UNIT} bytes for the name of the unit, and 2^31 "
            "nodes per level"
        )
    can_tell = packed and previous is not None and chain <= MOST_BEFORE and _same_cube(octree, previous)
    blocks = _store(octree, previous if can_tell else None, packed)
    levels = tuple(
        Level(int(nodes), *_sizes_and_check(above, own))
        for nodes, above, own in zip(octree.counts, blocks.masks, blocks.attributes, strict=True)
    )
    outside = _store_strays(strays, octree.edge)
    header = Header(
        flags=_PACKED * packed | _kinds(octree),
        before=chain if blocks.predicted or blocks.predicted_attributes else 0,
        predicted=blocks.predicted,
        time=time,
        low=octree.low,
        edge=octree.edge,
        points=octree.points,
        distinct=octree.distinct,
        unit=unit,
        levels=levels,
        predicted_attributes=blocks.predicted_attributes,
        strays=Level(len(strays or ()), *_sizes_and_check(*outside)),
    )
    if packed and _are_too_many(int(octree.counts.sum()), header.stored):
        return to_bytes(octree, time=time, unit=unit, packed=False, strays=strays)
    stored = itertools.chain.from_iterable(zip(blocks.masks, blocks.attributes, strict=True))
    return b"".join([header.to_bytes(), *outside, *stored])


def _sizes_and_check(first: bytes, second: bytes) -> tuple[int, int, int]:
    """The rest of a `Level` that these two blocks are of."""
    return len(first), len(second), zlib.crc32(first + second)


def from_bytes(data: bytes, previous: Octree | None = None, attributes: bool = True) -> Octree:
    """The tree of `to_bytes`, without strays; the coarser one where the bytes end behind one of its levels.

    previous: the tree before, where the header says that it takes one, with its attributes. attributes: False
    leaves them out.
    Raises InputError where bytes are missing or damaged.
    """
    header, size = read_header(data)

    def read(start: int, count: int) -> bytes:
        return data[size + start : size + start + count]

    *_, octree = read_levels(header, read, previous, attributes=attributes)
    return octree


Read = Callable[[int, int], bytes]  # (start, size): bytes behind a header, fewer where they end there


def read_levels(
    header: Header, read: Read, previous: Octree | None = None, attributes: bool = True
) -> Iterator[Octree]:
    """The tree behind a header, without strays, level by level: each time coarser trees are there whole, and
    the last is the finest that the bytes hold. Reads no byte before it is needed.

    previous, attributes: as for `from_bytes`. Raises InputError where bytes are missing within a level, or
    damaged, after the trees before them.
    """
    nodes = sum(level.nodes for level in header.levels)
    size = len(header.to_bytes()) + header.stored
    if _are_too_many(nodes, size):
        raise InputError(f"claims {nodes:,} octants in {size:,} bytes, which is too many")
    if header.before and (previous is None or not _can_tell(header, previous, attributes)):
        raise InputError("this octree depends on the octree before it, which is missing")
    before = previous if header.before else None
    coder = OccupancyCoder(before.masks if before else ())
    masks: list[Bytes] = []
    found: list[Attributes] = []
    values: Bytes | None = None
    for number, (above, own) in enumerate(_whole_levels(header, read)):
        if number:
            masks.append(_read_masks(above, header, coder, len(masks)))
        if attributes and header.width:
            predicted = before is not None and header.predicted_attributes >> number & 1
            known = _counterparts(before, coder.counterparts, number) if before and predicted else None
            values = _read_attributes(own, header.width, masks, values, known)
            found.append(_attributes(values, header))
        is_finest = number == len(header.levels) - 1
        kept = found if is_finest else [replace(each, own_radii=None) for each in found]  # which is of leaves
        yield Octree(header.low, header.edge, tuple(masks), header.points, header.distinct, tuple(kept))


def read_strays(header: Header, read: Read) -> Strays:
    """The points outside the cube of a tree of `to_bytes`. Raises InputError where bytes are missing or
    damaged."""
    entry = header.strays
    data = read(0, entry.masks + entry.attributes)
    if len(data) < entry.masks + entry.attributes:
        raise InputError("ends within the points outside an octree")
    if zlib.crc32(data) != entry.check:
        raise InputError("the points outside an octree are damaged")
    places = coding.unpack(data[: entry.masks], 24 * entry.nodes).reshape(24, -1).T
    positions = np.ascontiguousarray(places).view("<f8").astype(np.float64)
    if not (np.abs(positions) < _LARGEST).all():
        raise InputError("some points outside an octree have coordinates that are not finite")
    found = Attributes()
    if header.width:
        values = coding.unpack(data[entry.masks :], header.width * entry.nodes)
        found = _attributes(values.reshape(header.width, -1).T, header)
    return Strays(positions.reshape(-1, 3), found.colors, found.normals, found.own_radii)


def read_header(data: bytes) -> tuple[Header, int]:
    """The header at the beginning of the bytes, and its size. Raises InputError where it is none."""
    if not data.startswith(MAGIC):
        raise InputError("no octree begins where the file should contain one")
    if len(data) < _FIXED.size:
        raise CutShort("ends within the header of an octree")
    _, version, flags, before, depth, unit_size, _, *place = _FIXED.unpack_from(data)
    if version != VERSION:
        raise InputError(
            f"contains octrees of format version {version}",
            hint=f"This version of Scan4D reads format version {VERSION}",
        )
    start = _FIXED.size + unit_size
    end = start + (depth + 1) * _LEVEL.size
    if len(data) < end + _CHECK.size:
        raise CutShort("ends within the header of an octree")
    if _CHECK.unpack_from(data, end)[0] != zlib.crc32(data[:end]):
        raise InputError("the header of an octree is damaged")
    levels = tuple(Level(*values) for values in _LEVEL.iter_unpack(data[start:end]))
    predicted, time, x, y, z, edge, points, distinct, predicted_attributes, *strays = place
    unit = data[_FIXED.size : start].decode(errors="replace")
    low = np.array([x, y, z])
    kind = flags, before, predicted
    header = Header(
        *kind, time, low, edge, points, distinct, unit, levels, predicted_attributes, Level(*strays)
    )
    if not _is_possible(header):
        raise InputError("the numbers in the header of an octree contradict each other")
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
        and all(0 < below <= 8 * above for above, below in itertools.pairwise(nodes))
        and header.levels[0].masks == 0
        and (header.before > 0) == (header.predicted > 0 or header.predicted_attributes > 0)
        and (header.width or not header.predicted_attributes)
        and (header.flags & _PACKED or not header.before)
    )


def _are_too_many(nodes: int, stored: int) -> bool:
    """Whether nodes would take far more memory than what is stored of them: such trees are stored as they
    are, and bytes that promise one are refused."""
    return nodes > max(_FREE, coding.MOST_RATIO * stored)


def _can_tell(header: Header, previous: Octree, attributes: bool) -> bool:
    """Whether the tree before is the one that a header needs. attributes: of which they are asked for."""
    missing = attributes and header.predicted_attributes and _kinds(previous) != header.flags & ~_PACKED
    return _same_cube(header, previous) and not missing


def _same_cube(one: Octree | Header, other: Octree) -> bool:
    return one.edge == other.edge and bool((one.low == other.low).all())


def _whole_levels(header: Header, read: Read) -> Iterator[tuple[bytes, bytes]]:
    """Stored bytes of each level, masks and attributes, as far as there are any."""
    at = header.strays.masks + header.strays.attributes
    for number, level in enumerate(header.levels):
        size = level.masks + level.attributes
        data = read(at, size)
        if number and not data:
            return
        if len(data) < size:
            raise InputError(f"ends within level {number} of {len(header.levels) - 1} of an octree")
        if zlib.crc32(data) != level.check:
            raise InputError(f"level {number} of an octree is damaged")
        yield data[: level.masks], data[level.masks :]
        at += size


# --- strays ---------------------------------------------------------------------------


def _store_strays(strays: Strays | None, edge: float) -> tuple[bytes, bytes]:
    """Stored positions and attributes, by columns of bytes."""
    if not strays:
        return b"", b""
    places = np.ascontiguousarray(strays.positions, "<f8").view(np.uint8)
    own = Attributes(strays.colors, strays.normals, own_radii=strays.radii)
    values = _bytes(own, edge, len(strays))
    return coding.pack(places.T.ravel()), coding.pack(values.T.ravel())


# --- masks ----------------------------------------------------------------------------


class _Blocks(NamedTuple):
    """Stored masks and attributes of each level. predicted, predicted_attributes: as in a `Header`."""

    masks: list[bytes]
    attributes: list[bytes]
    predicted: int = 0
    predicted_attributes: int = 0

    @property
    def size(self) -> int:
        return sum(map(len, [*self.masks, *self.attributes]))


def _store(octree: Octree, previous: Octree | None, packed: bool) -> _Blocks:
    """Blocks of each level; the shorter ones are predicted from the tree before, if that is worth it."""
    if not packed:
        return _Blocks([b"", *(masks.tobytes() for masks in octree.masks)], _store_attributes(octree))
    by_itself = _Blocks(_store_masks(octree).blocks, _store_attributes(octree))
    if previous is None:
        return by_itself
    masks = _store_masks(octree, previous)
    of_attributes = _store_attributes(octree, previous, masks.places)
    shorter = _Blocks(
        masks.blocks,
        [min(pair, key=len) for pair in zip(by_itself.attributes, of_attributes, strict=True)],
        masks.predicted,
        _shorter(of_attributes, by_itself.attributes),
    )
    return shorter if shorter.size <= _WORTH * by_itself.size else by_itself


class _Masks(NamedTuple):
    """Stored masks. predicted: as in a `Header`. places: of each level the counterparts of its nodes."""

    blocks: list[bytes]
    predicted: int
    places: list[Nodes]


def _store_masks(octree: Octree, previous: Octree | None = None) -> _Masks:
    """Masks of each level; the shorter ones are predicted from the tree before."""
    coder = OccupancyCoder(previous.masks if previous else ())
    blocks, predicted, places = [b""], 0, [coder.counterparts]
    for level, masks in enumerate(octree.masks):
        data, learnt = coder.encode(masks)
        if previous is not None:
            other = coder.encode(masks, predicted=True)
            if len(other[0]) < len(data):
                predicted |= 1 << level
                data, learnt = other
        blocks.append(data)
        coder.descend(masks, learnt)
        places.append(coder.counterparts)
    return _Masks(blocks, predicted, places)


def _shorter(predicted: list[bytes], alone: list[bytes]) -> int:
    """Bit n: the block of level n is shorter where it is predicted from the tree before."""
    is_shorter = (len(one) < len(other) for one, other in zip(predicted, alone, strict=True))
    return sum(1 << level for level, yes in enumerate(is_shorter) if yes)


def _read_masks(stored: bytes, header: Header, coder: OccupancyCoder, level: int) -> Bytes:
    """The masks of a level, whose nodes below are as many as the header says; the coder goes on below."""
    if header.flags & _PACKED:
        masks, learnt = coder.decode(stored, predicted=bool(header.predicted >> level & 1))
    elif len(stored) == header.levels[level].nodes:
        masks = np.frombuffer(stored, np.uint8)
    else:
        raise InputError(f"level {level + 1} of an octree has a different number of masks than nodes above")
    if np.bitwise_count(masks).sum(dtype=np.int64) != header.levels[level + 1].nodes:
        raise InputError(
            f"level {level + 1} of an octree has a different number of nodes than the header states"
        )
    if header.flags & _PACKED:
        coder.descend(masks, learnt)
    return masks


# --- attributes -------------------------------------------------------------------------


def _kinds(octree: Octree) -> int:
    """The flags of the attributes that a tree has."""
    if not octree.attributes:
        return 0
    root = octree.attributes[0]
    of_surface = _COLORS * (root.colors is not None) | _NORMALS * (root.normals is not None)
    return of_surface | _RADII * (root.own_radii is not None)


def _store_attributes(
    octree: Octree, previous: Octree | None = None, places: Sequence[Nodes] = ()
) -> list[bytes]:
    """Stored attributes of each level. previous: the tree that tells them. places: the counterparts there of
    the nodes of each level."""
    if not _kinds(octree):
        return [b""] * (octree.depth + 1)
    if previous is not None and _kinds(previous) != _kinds(octree):
        previous = None
    values = [_bytes(each, octree.edge) for each in octree.attributes]
    stored = [coding.pack(values[0].ravel(), _OF_ATTRIBUTES)]
    for level, (above, below, masks) in enumerate(zip(values, values[1:], octree.masks, strict=False), 1):
        known = _counterparts(previous, places[level], level) if previous else None
        stored.append(coding.pack(coding.differences(below, above, masks, known), _OF_ATTRIBUTES))
    return stored


def _counterparts(previous: Octree, nodes: Nodes, level: int) -> Counterparts | None:
    """Counterparts of a level's nodes in the tree before, and their bytes; None where it lacks the level."""
    if level >= len(previous.attributes):
        return None
    return Counterparts(nodes, _bytes(previous.attributes[level], previous.edge))


def _bytes(attributes: Attributes, edge: float, count: int = 0) -> Bytes:
    """(n, k) bytes of what there is. edge: of the cube. count: n where there is nothing."""
    parts = []
    if attributes.colors is not None:
        parts.append(coding.color_bytes(attributes.colors))
    if attributes.normals is not None:
        parts.append(coding.normal_bytes(attributes.normals))
    if attributes.own_radii is not None:
        parts.append(coding.radius_bytes(attributes.own_radii, edge))
    return np.concatenate(parts, axis=1) if parts else np.zeros((count, 0), np.uint8)


def _read_attributes(
    stored: bytes, width: int, masks: list[Bytes], above: Bytes | None, known: Counterparts | None
) -> Bytes:
    """(n, k) bytes of the next level. masks: of the levels above. above: the bytes of the last of them.
    known: what the tree before tells."""
    if above is None:
        return coding.unpack(stored, width, _OF_ATTRIBUTES).reshape(1, -1)
    size = width * coding.sibling_count(masks[-1])
    return coding.restored(coding.unpack(stored, size, _OF_ATTRIBUTES), above, masks[-1], known)


def _attributes(values: Bytes, header: Header) -> Attributes:
    has_colors, has_normals = bool(header.flags & _COLORS), bool(header.flags & _NORMALS)
    normals = values[:, 4 * has_colors :][:, :2]
    return Attributes(
        colors=coding.colors_of(values[:, :4]) if has_colors else None,
        normals=coding.normals_of(normals) if has_normals else None,
        own_radii=coding.radii_of(values[:, -1], header.edge) if header.flags & _RADII else None,
    )
