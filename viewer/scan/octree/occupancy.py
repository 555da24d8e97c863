"""Which children the nodes of a tree have, as few bytes: level by level, by adaptive arithmetic coding.

Whoever reads a level knows all levels above it and, of a sequence, the whole tree of the pose before. How
likely each child is follows from these and from the nodes before it, see `occupancy_kernels`. Large levels
are parts that do not know of each other, so that all processors work on them.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...threads import ranges, shares, together
from .children import Bytes, Children, Nodes

_PART = 1 << 14  # nodes of a part, at least, where a level has as many


class Learnt(NamedTuple):
    """Probabilities and weights after a level, see `occupancy_kernels.Models`."""

    seen: NDArray[np.uint32]
    weights: NDArray[np.int64]

    def copy(self) -> Learnt:
        """A copy of what is learnt, which learns more by itself."""
        return Learnt(self.seen.copy(), self.weights.copy())


class _Above(NamedTuple):
    """The level above. masks: (n,). first: (n,), the first child of each node."""

    masks: Bytes
    first: Nodes


class OccupancyCoder:
    """Codes the masks of a tree level by level; it begins at the root."""

    def __init__(self, before: tuple[Bytes, ...] = ()) -> None:
        """before: the masks of the tree before, on the same cube."""
        from . import occupancy_kernels

        self._kernels = occupancy_kernels
        self._learnt = Learnt(*occupancy_kernels.Models.new())
        self._before = before
        self._above = _Above(np.ones(1, np.uint8), np.zeros(1, np.int32))  # around the root
        self._around: NDArray[np.int32] | None = np.where(np.arange(27) == 13, 0, -1).astype(np.int32)[None]
        self._higher: tuple[_Above, NDArray[np.int32]] | None = None
        self.counterparts: Nodes = np.zeros(1, np.int32)  # the same octants in the tree before, -1: none

    def encode(self, masks: Bytes, predicted: bool = False) -> tuple[bytes, Learnt]:
        """A level with these masks, (n,), as it is stored, and what it teaches. predicted: by the tree
        before."""
        parts = self._parts()
        room = [self._kernels.MOST * (end - begin + 1) for begin, end in parts]
        blocks = [np.zeros(size, np.uint8) for size in room]
        taken, learnt = self._code(masks.copy(), parts, blocks, predicted, decodes=False)
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
        masks = np.zeros(parts[-1][1], np.uint8)
        _, learnt = self._code(masks, parts, np.split(data[start:], ends - start), predicted, decodes=True)
        return masks, learnt

    def descend(self, masks: Bytes, learnt: Learnt) -> None:
        """Go on to the level below the one that has these masks, with what these have taught."""
        counts = np.bitwise_count(masks)
        self._higher, self._around = (self._above, self._nodes_around()), None
        self._above = _Above(masks, np.cumsum(counts, dtype=np.int32) - counts)
        self._learnt = learnt
        if self._before:
            children = Children(masks)
            above = self.counterparts[children.parents]
            self.counterparts = Children(self._before[0]).find(above, children.octants)
            self._before = self._before[1:]
        else:
            self.counterparts = np.full(int(counts.sum(dtype=np.int64)), -1, np.int32)

    def _code(
        self, masks: Bytes, parts: list[tuple[int, int]], blocks: list[Bytes], predicted: bool, decodes: bool
    ) -> tuple[list[int], Learnt]:
        """Code all parts, or decode them. Returns the bytes that each takes, and what the first teaches."""
        kernels, above, around = self._kernels, self._above, self._nodes_around()
        known = np.zeros(len(masks), np.uint8)
        if predicted and self._before:
            known = np.append(self._before[0], np.uint8(0))[self.counterparts]
        taken = [0] * len(parts)
        learnt = self._learnt.copy()

        def part(number: int) -> None:
            begin, end = parts[number]
            models = kernels.Models(*(learnt if number == 0 else self._learnt.copy()))
            found = kernels.Surroundings.empty(end - begin)
            parents = np.searchsorted(above.first, [begin, end - 1], side="right")
            kernels.survey(*above, around, (int(parents[0]) - 1, int(parents[1])), found)
            some = slice(begin, end)
            taken[number] = kernels.code_part(
                found, known[some], models, blocks[number], masks[some], decodes
            )

        together(len(masks), [partial(part, number) for number in range(len(parts))])
        return taken, learnt

    def _nodes_around(self) -> NDArray[np.int32]:
        """(n, 27): of the level above, the nodes around each."""
        if self._around is None:
            assert self._higher is not None, "a level below the first has one above"
            above, around = self._higher
            self._higher = None
            self._around = np.empty((len(self._above.masks), 27), np.int32)
            works = (
                partial(self._kernels.go_down, *above, around, some, self._around)
                for some in shares(len(above.masks))
            )
            together(len(above.masks), works)
        return self._around

    def _parts(self) -> list[tuple[int, int]]:
        """(first, last + 1) of the nodes of each part of the level; no part divides siblings."""
        masks, first = self._above
        nodes = int(first[-1]) + int(np.bitwise_count(masks[-1]))
        even = np.linspace(0, nodes, max(nodes // _PART, 1) + 1).astype(np.int64)[1:-1]
        cuts = first[np.searchsorted(first, even, side="right") - 1]
        return ranges(np.unique([0, *cuts, nodes]))
