"""Which children the nodes of a tree have, as few bytes: level by level, by adaptive arithmetic coding.

Whoever reads a level knows all levels above it and, of a sequence, the whole tree of the pose before. How
likely each child is follows from these and from the nodes before it, see `occupancy_kernels`. Large levels
are parts that do not know of each other, so that all processors work on them.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...threads import ranges, shares, together
from .octree import Bytes, Nodes

_PART = 1 << 16  # nodes of a part, at least, where a level has as many


Learnt = NDArray[np.int32]  # scores and counts after a level, see `occupancy_kernels.code_part`


class _Surveyed(NamedTuple):
    """The surroundings of a level. beside: (n,), see `occupancy_kernels.Occupied`. planes: (5, m), see
    `occupancy_kernels.fit_planes`, of the nodes above."""

    beside: NDArray[np.int32]
    planes: NDArray[np.int32]


class OccupancyCoder:
    """Codes the masks of a tree level by level; it begins at the root."""

    def __init__(self, before: tuple[Bytes, ...] = ()) -> None:
        """before: the masks of the tree before, on the same cube."""
        from . import occupancy_kernels

        self._kernels = occupancy_kernels
        self._learnt: Learnt = np.zeros(occupancy_kernels.SITUATIONS, np.int32)
        self._before = before
        alone = np.where(np.arange(27) == 13, 0, 1).astype(np.int32)[None]
        around_root = np.array([1, 0], np.uint8), np.array([0, 1], np.int32)
        self._above = occupancy_kernels.Occupied(*around_root, alone, np.array([1 << 13], np.int32))
        self._higher: Any = None  # the level above that, until what is around it is known
        self._surveyed: _Surveyed | None = None
        self._agrees = np.ones(1, np.bool_)
        self.counterparts: Nodes = np.zeros(1, np.int32)  # the same octants in the tree before, -1: none

    def encode(self, masks: Bytes, predicted: bool = False) -> tuple[bytes, Learnt]:
        """A level with these masks, (n,), as it is stored, and what it teaches. predicted: by the tree
        before."""
        parts = self._parts()
        room = [self._kernels.MOST * (end - begin + 1) for begin, end in parts]
        blocks = [np.zeros(size, np.uint8) for size in room]
        taken, learnt = self._code(np.append(masks, np.uint8(0)), parts, blocks, predicted, decodes=False)
        sizes = np.array(taken[:-1], "<u4").tobytes()
        found = (block[:size].tobytes() for block, size in zip(blocks, taken, strict=True))
        return sizes + b"".join(found), learnt

    def decode(self, stored: bytes, predicted: bool = False) -> tuple[Bytes, Learnt]:
        """The masks of the level, (n,), of `encode`, and what they teach.

        Bytes that are damaged give other masks. Raises InputError where the parts are longer than what is
        stored.
        """
        parts = self._parts()
        data = np.frombuffer(bytearray(stored), np.uint8)  # compiled code takes none that are read-only
        start = 4 * (len(parts) - 1)
        sizes = np.frombuffer(stored[: min(start, len(data) // 4 * 4)], "<u4")
        ends = start + np.cumsum(sizes, dtype=np.int64)
        if max([start, *ends]) > len(data):
            raise InputError("the parts of a level are longer than the level")
        masks = np.zeros(parts[-1][1] + 1, np.uint8)
        _, learnt = self._code(masks, parts, np.split(data[start:], ends - start), predicted, decodes=True)
        return masks[:-1], learnt

    def descend(self, masks: Bytes, learnt: Learnt) -> None:
        """Go on to the level below the one that has these masks, with what these have taught."""
        padded, beside = np.append(masks, np.uint8(0)), self._survey().beside
        counts = np.bitwise_count(padded)
        first = np.cumsum(counts, dtype=np.int32) - counts
        later = np.empty((0, 27), np.int32)
        self._higher, self._above = self._above, self._kernels.Occupied(padded, first, later, beside)
        self._surveyed = None
        self._learnt = learnt
        self._agrees = np.zeros(len(masks), np.bool_)
        if self._before:
            other, below = np.append(self._before[0], np.uint8(0)), np.empty(int(first[-1]), np.int32)
            self._kernels.follow(padded, other, self.counterparts, self._agrees, below)
            self.counterparts, self._before = below, self._before[1:]
        else:
            self.counterparts = np.full(int(first[-1]), -1, np.int32)

    def _code(
        self, masks: Bytes, parts: list[tuple[int, int]], blocks: list[Bytes], predicted: bool, decodes: bool
    ) -> tuple[list[int], Learnt]:
        """Code all parts, or decode them. masks: one more, which stands for none. Returns the bytes that each
        part takes, and what the first teaches."""
        kernels, surveyed, above = self._kernels, self._survey(), self._above
        expected = np.zeros(len(masks) - 1, np.uint8)
        if predicted and self._before:
            expected = np.append(self._before[0], np.uint8(0))[self.counterparts]
        coded = kernels.Coded(surveyed.beside, expected, self._agrees, masks)
        taken = [0] * len(parts)
        others = [self._learnt.copy() for _ in parts[1:]]
        learnt = self._learnt if decodes else self._learnt.copy()

        def part(number: int) -> None:
            begin, end = np.searchsorted(above.first[:-1], parts[number])
            own = others[number - 1] if number else learnt
            taken[number] = kernels.code_part(
                above, surveyed.planes, (int(begin), int(end)), coded, own, blocks[number], decodes
            )

        together(len(expected), [partial(part, number) for number in range(len(parts))])
        return taken, learnt

    def _survey(self) -> _Surveyed:
        """The surroundings of the nodes of the level."""
        if self._surveyed is None:
            self._go_down()
            above = self._above
            nodes = len(above.masks) - 1
            found = _Surveyed(np.empty(int(above.first[-1]), np.int32), np.empty((5, nodes), np.int32))

            def work(some: tuple[int, int]) -> None:
                self._kernels.look_around(above, some, found.beside)
                self._kernels.fit_planes(above, some, found.planes)

            together(nodes, [partial(work, some) for some in shares(nodes)])
            self._surveyed = found
        return self._surveyed

    def _go_down(self) -> None:
        """Find the nodes around those above, which only another level needs."""
        higher = self._higher
        if higher is not None:
            around = np.empty((len(self._above.masks) - 1, 27), np.int32)
            beside, some = self._above.beside, shares(len(higher.masks) - 1)
            together(
                len(around),
                [partial(self._kernels.go_down, higher, beside, each, around) for each in some],
            )
            self._above, self._higher = self._above._replace(around=around), None

    def _parts(self) -> list[tuple[int, int]]:
        """(first, last + 1) of the nodes of each part of the level; no part divides siblings."""
        first = self._above.first
        nodes = int(first[-1])
        even = np.linspace(0, nodes, max(nodes // _PART, 1) + 1).astype(np.int64)[1:-1]
        cuts = first[np.searchsorted(first, even, side="right") - 1]
        return ranges(np.unique([0, *cuts, nodes]))
