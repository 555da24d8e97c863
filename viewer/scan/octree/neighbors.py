"""Which nodes of one level lie side by side, found from the root down."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Nodes = NDArray[np.int32]  # numbers of nodes of one level, -1 for none

_AT_ONCE = 1 << 16  # nodes worked on together, so that steps between take little memory


class Children:
    """The nodes below one level. parents: (m,) numbers of nodes, ascending. octants: (m,) uint8, 0..7."""

    def __init__(self, masks: Bytes) -> None:
        """masks: (n,), of the level above."""
        self._masks = np.append(masks, np.uint8(0))  # the last one stands for no node
        counts = np.bitwise_count(self._masks)
        self._first = np.cumsum(counts, dtype=np.int32)
        total = int(self._first[-1])
        self._first -= counts
        self.parents: Nodes = np.empty(total, np.int32)
        self.octants: Bytes = np.empty(total, np.uint8)
        for start in range(0, len(masks), _AT_ONCE):
            there = np.flatnonzero(np.unpackbits(masks[start : start + _AT_ONCE], bitorder="little"))
            at = int(self._first[start])
            self.parents[at : at + len(there)] = start + (there >> 3)
            self.octants[at : at + len(there)] = there & 7

    def find(self, nodes: Nodes, octants: Bytes) -> Nodes:
        """The child of each node in an octant, -1 for none; a node -1 has none."""
        masks, bits = self._masks[nodes], np.uint8(1) << octants
        found = self._first[nodes] + np.bitwise_count(masks & bits - np.uint8(1))
        return np.where(masks & bits, found, np.int32(-1))


class Neighbors:
    """The nodes of one level that touch others with a face; first those of level 0.

    beside: for each of the faces -x, +x, -y, +y, -z, +z, (n,) the node of the same level there.
    """

    def __init__(self, root: int) -> None:
        """root: how many nodes level 0 has, 0 or 1."""
        self.beside: list[Nodes] = [np.full(root, -1, np.int32) for _ in range(6)]

    def around(self) -> Bytes:
        """(n,): bit i: there is a node at face i."""
        bits = np.zeros(len(self.beside[0]), np.uint8)
        for face, nodes in enumerate(self.beside):
            bits |= (nodes >= 0).view(np.uint8) << np.uint8(face)
        return bits

    def descend(self, masks: Bytes) -> Children:
        """Go on to the level below the one that has these masks."""
        children = Children(masks)
        for face in range(6):
            self.beside[face] = self._below(children, face)
        return children

    def _below(self, children: Children, face: int) -> Nodes:
        """`beside` of the level below."""
        axis, side = divmod(face, 2)
        below = np.empty(len(children.parents), np.int32)
        for start in range(0, len(below), _AT_ONCE):
            some = slice(start, start + _AT_ONCE)
            parents, octants = children.parents[some], children.octants[some]
            is_outside = (octants >> np.uint8(axis) & np.uint8(1)) == side
            nodes = np.where(is_outside, self.beside[face][parents], parents)
            below[some] = children.find(nodes, octants ^ np.uint8(1 << axis))
        return below
