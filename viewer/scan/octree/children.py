"""Which nodes of one level are below which of the level above."""

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
