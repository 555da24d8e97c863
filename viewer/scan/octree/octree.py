"""What a sparse voxel octree is: a cube, and a mask of children for each inner node, breadth-first."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Nodes = NDArray[np.int32]  # numbers of nodes of one level, -1 for none

DEEPEST = 21  # the last level: three coordinates of 21 bits are a Morton code of 63
_AT_ONCE = 1 << 16  # nodes worked on together, so that steps between take little memory
_TOGETHER = (  # shifts and masks that bring every third bit together
    (2, 0x10C30C30C30C30C3), (4, 0x100F00F00F00F00F), (8, 0x1F0000FF0000FF), (16, 0x1F00000000FFFF),
    (32, 0x1FFFFF),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Attributes:
    """Attributes of the nodes of one level, means over all points below each.

    colors:  (n, 4) uint8, sRGB and alpha, or None; means in linear light
    normals: (n, 3) float32, unit length, or None; 0 where normals cancel
    cones:   (n,) float32, or None: the cosine of the half angle of the cone about the normal that
             holds all normals below, -1..1; -1 where there is no normal, or a point below has none
    rows:    (n,) uint32, or None: the lowest row below in the arrays of the cloud
    offsets: (n, 3) uint16, or None: where the surface is in the node's cell: of a leaf the mean position of
             its points, of others that of the leaves below, in 65536ths of the cell's edge
    radii:   (n,) float32, scan units, or None: of discs there that close the surface
    own_radii: (n,) float32, scan units, or None: the largest radius that a point below stores; 0 for none
    """

    colors: NDArray[np.uint8] | None = None
    normals: NDArray[np.float32] | None = None
    cones: NDArray[np.float32] | None = None
    rows: NDArray[np.uint32] | None = None
    offsets: NDArray[np.uint16] | None = None
    radii: NDArray[np.float32] | None = None
    own_radii: NDArray[np.float32] | None = None


@dataclass(frozen=True, eq=False)
class Octree:
    """The occupied octants of a cube, level by level; level 0 is the cube itself.

    low:        (3,) float64, the cube's lowest corner, absolute, scan units
    edge:       of the cube, scan units
    masks:      for each level above the deepest, (n,) uint8, its nodes by ascending Morton code; bit i:
                child i = x | y << 1 | z << 2 is there. 0: the node is a leaf, which only trees that
                stop by occupancy have above the deepest level
    points:     how many points lie in it
    distinct:   how many different positions these have
    attributes: for each level, the deepest included, or empty: geometry alone
    strays:     (s,) uint32, ascending: rows, in the arrays of the cloud, of the points outside the cube
    """

    low: NDArray[np.float64]
    edge: float
    masks: tuple[NDArray[np.uint8], ...]
    points: int
    distinct: int
    attributes: tuple[Attributes, ...] = ()
    strays: NDArray[np.uint32] = field(default_factory=lambda: np.empty(0, np.uint32))

    @property
    def depth(self) -> int:
        """The deepest level; 0: the cube is the only node."""
        return len(self.masks)

    @cached_property
    def counts(self) -> NDArray[np.int64]:
        """(depth + 1,): how many nodes each level has, oct(h)."""
        children = [int(np.bitwise_count(masks).sum(dtype=np.int64)) for masks in self.masks]
        return np.array([min(self.points, 1), *children], np.int64)

    @cached_property
    def leaves(self) -> int:
        """How many nodes have no children."""
        return int(self.counts[-1]) + sum(int(np.count_nonzero(masks == 0)) for masks in self.masks)

    @property
    def nbytes(self) -> int:
        """Bytes held by masks, attributes and strays."""
        attributes = (getattr(level, one.name) for level in self.attributes for one in fields(level))
        return sum(a.nbytes for a in (self.strays, *self.masks, *attributes) if a is not None)

    @property
    def loss(self) -> float:
        """The share of distinct positions that have no leaf of their own (Slomp 2014, Table III)."""
        return 1 - self.leaves / self.distinct if self.distinct else 0.0

    @cached_property
    def first_child(self) -> tuple[NDArray[np.uint32], ...]:
        """Rows for each level above the deepest, (n,): where in the next level each node's children begin."""
        ends = [np.cumsum(np.bitwise_count(masks), dtype=np.uint32) for masks in self.masks]
        return tuple(np.concatenate([np.zeros(1, np.uint32), end[:-1]]) for end in ends)

    def size(self, level: int) -> float:
        """The edge of a node, scan units."""
        return math.ldexp(self.edge, -int(level))

    def codes(self, level: int) -> NDArray[np.uint64]:
        """(oct(level),) ascending Morton codes: three bits a level, x the lowest of them."""
        codes = np.zeros(int(self.counts[0]), np.uint64)
        for masks in self.masks[:level]:
            there = np.flatnonzero(np.unpackbits(masks, bitorder="little"))
            codes = codes[there >> 3] << np.uint64(3) | (there & 7).astype(np.uint64)
        return codes

    def cells(self, level: int) -> NDArray[np.int64]:
        """(oct(level), 3): x, y, z of each node among 2^level along each edge of the cube."""
        cells = np.zeros((int(self.counts[0]), 3), np.int64)
        octants = np.array([[child & 1, child >> 1 & 1, child >> 2] for child in range(8)])
        for masks in self.masks[:level]:
            there = np.flatnonzero(np.unpackbits(masks, bitorder="little"))
            cells = 2 * np.take(cells, there >> 3, axis=0) + np.take(octants, there & 7, axis=0)
        return cells

    def centers(self, level: int) -> NDArray[np.float64]:
        """(oct(level), 3) float64, absolute, scan units."""
        return self.centers_of(self.codes(level), level)

    def centers_of(
        self, codes: NDArray[np.uint64], level: int, origin: NDArray[np.float64] | None = None
    ) -> NDArray[Any]:
        """(n, 3), scan units, of the nodes of a level with these codes (n,).

        float64, absolute; float32 from an origin where there is one.
        """
        centers = np.empty((len(codes), 3), np.float64 if origin is None else np.float32)
        for start in range(0, len(codes), _AT_ONCE):
            some = slice(start, start + _AT_ONCE)
            for axis in range(3):
                cells = _every_third_bit(codes[some] >> np.uint64(axis))
                absolute = self.low[axis] + (cells + 0.5) * self.size(level)
                centers[some, axis] = absolute if origin is None else absolute - origin[axis]
        return centers

    def prefix(self, level: int) -> Octree:
        """The tree down to a level, which shares its arrays: the same scan, coarser."""
        level = min(level, self.depth)
        return replace(self, masks=self.masks[:level], attributes=self.attributes[: level + 1])


def _every_third_bit(codes: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The coordinate that the bits 0, 3, 6... of Morton codes hold."""
    bits = codes & np.uint64(0x1249249249249249)
    for shift, mask in _TOGETHER:
        bits = (bits | bits >> np.uint64(shift)) & np.uint64(mask)
    return bits
