"""Which nodes of an octree a view shows (Slomp 2014, VI-B): from the root down, level by level."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .octree import DEEPEST, Octree

_SPARE = 1  # entries that `cut_kernels.descend` may write beyond the children
_CHUNK = 1 << 16  # nodes between two looks at the clock, about half a millisecond


@dataclass(frozen=True, eq=False)
class Sight:
    """A camera as a cut needs it, in absolute scan units.

    eye:         (3,) float64
    axes:        (3, 3) float64: the picture's right, up and backward axes, world to view
    scale:       pixels per unit of x/depth (perspective) or of x (orthographic)
    size:        of the picture, (width, height) pixels
    near, far:   depths; what is outside is not shown
    """

    eye: NDArray[np.float64]
    axes: NDArray[np.float64]
    scale: float
    size: tuple[int, int]
    near: float
    far: float
    perspective: bool

    def planes(self) -> NDArray[np.float64]:
        """(p, 4): inward unit normals, and offsets from the eye, of the sides, near and far."""
        x, y = (pixels / 2 / self.scale for pixels in self.size)
        sides = [[1.0, 0, 0, x], [-1, 0, 0, x], [0, 1, 0, y], [0, -1, 0, y]]
        if self.perspective:  # depth is -z
            sides = [[1.0, 0, -x, 0], [-1, 0, -x, 0], [0, 1, -y, 0], [0, -1, -y, 0]]
        ends = [[0.0, 0, -1, -self.near]] + ([[0.0, 0, 1, self.far]] if math.isfinite(self.far) else [])
        planes = np.array(sides + ends)
        planes[:, :3] = planes[:, :3] @ self.axes
        return planes / np.linalg.norm(planes[:, :3], axis=1)[:, None]


@dataclass(frozen=True, eq=False)
class CubeSight:
    """A camera as it sees an octree's cube: positions are relative to the cube's lowest corner.

    eye:    (3,) float64
    back:   (3,) float64, opposite to the view's direction
    planes: (p, 4) float64, inward unit normals and offsets
    least:  scan units; nodes with such an edge are large enough wherever in the cube they are
    """

    eye: NDArray[np.float64]
    back: NDArray[np.float64]
    planes: NDArray[np.float64]
    perspective: bool
    scale: float
    near: float
    least: float

    @classmethod
    def of(cls, octree: Octree, sight: Sight, pixel_threshold: float) -> CubeSight:
        """A camera's sight of an octree, whose nodes of a lesser edge, in pixels, are not divided."""
        eye = np.asarray(sight.eye, np.float64) - octree.low
        back = np.ascontiguousarray(sight.axes[2], np.float64)
        planes = sight.planes()
        planes[:, 3] -= planes[:, :3] @ eye
        middle = float(back @ (eye - octree.edge / 2))
        reach = max(middle + octree.edge * math.sqrt(3) / 2, sight.near) if sight.perspective else 1.0
        scale = float(sight.scale)
        least = pixel_threshold * reach / scale
        return cls(eye, back, planes, sight.perspective, scale, float(sight.near), least)


@dataclass(frozen=True, eq=False)
class Cut:
    """Nodes that stand for all that a view shows of an octree: none holds another, nothing is left out.

    level:     (n,) uint8; the deepest first, and within a level the nearest first, parent by parent
    index:     (n,) uint32, which node of its level
    positions: (n, 3) float32, scan units, relative to the origin that was asked for: the centres of their
               cells, or where the surface is in these
    halves:    (n,) float32, half of the edges
    complete:  whether every node is a leaf, at the greatest depth, or small enough
    outside, facing_away: how many nodes were left out with all below, by cause
    """

    level: NDArray[np.uint8]
    index: NDArray[np.uint32]
    positions: NDArray[np.float32]
    halves: NDArray[np.float32]
    complete: bool
    outside: int
    facing_away: int

    def __len__(self) -> int:
        return len(self.level)

    def numbers(self, octree: Octree) -> NDArray[np.uint32]:
        """(n,): the nodes' numbers among all of the tree, breadth-first."""
        starts = np.cumsum(octree.counts) - octree.counts
        return starts.astype(np.uint32)[self.level] + self.index

    def gather(self, octree: Octree, name: str) -> NDArray:
        """(n, ...): an attribute of the nodes by its name, which the tree has."""
        return self.pick([getattr(level, name) for level in octree.attributes])

    def pick(self, values: Sequence[NDArray]) -> NDArray:
        """(n, ...): of values of all nodes, level by level, those of the nodes of the cut."""
        borders = np.flatnonzero(np.diff(self.level, prepend=255, append=255))
        parts = [
            np.take(values[self.level[a]], self.index[a:b], axis=0) for a, b in pairwise(borders.tolist())
        ]
        return np.concatenate(parts) if parts else values[0][:0]


@dataclass(frozen=True, eq=False)
class _Nodes:
    """Nodes of one level: places (n,) uint64 and indices (n,) uint32, see `cut_kernels`."""

    places: NDArray[np.uint64]
    indices: NDArray[np.uint32]

    @classmethod
    def room(cls, count: int) -> _Nodes:
        """Nodes with room for so many."""
        return cls(np.empty(count, np.uint64), np.empty(count, np.uint32))

    def __len__(self) -> int:
        return len(self.places)

    def part(self, start: int, stop: int | None = None) -> _Nodes:
        """Some of them, in the same memory."""
        return _Nodes(self.places[start:stop], self.indices[start:stop])

    def all_within(self) -> bool:
        """Whether planes need not be asked."""
        return bool((self.places >> np.uint64(63)).all())


class Traversal:
    """A cut that gets finer with every `advance`, and is whole at any time.

    A node gives way to all of its children at once, so what a finer cut lacks holds no point that is seen.
    One object serves all views of a tree, one after the other, in the same memory.

    pixel_threshold: nodes of a lesser edge, in pixels, are not divided. max_depth: nor are those of this
    level. cull_cones: nodes whose normals all face away are left out, where the tree has normals. margins:
    how far what is drawn of the nodes of each level, and of those below them, reaches beyond their spheres,
    scan units; empty: not at all.
    """

    def __init__(
        self,
        octree: Octree,
        sight: Sight,
        *,
        pixel_threshold: float = 1.0,
        max_depth: int = DEEPEST,
        cull_cones: bool = True,
        margins: Sequence[float] = (),
    ) -> None:
        self.octree = octree
        self._margins = margins or [0.0] * (octree.depth + 1)
        self._threshold = float(pixel_threshold)
        self._depth = max(0, min(max_depth, octree.depth))
        self._cones = cull_cones and bool(octree.attributes) and octree.attributes[0].cones is not None
        self._rooms: dict[tuple[str, int], _Nodes] = {}
        self.look(sight)

    @property
    def nbytes(self) -> int:
        """Bytes of the memory that it works in."""
        return sum(room.places.nbytes + room.indices.nbytes for room in self._rooms.values())

    def look(self, sight: Sight) -> None:
        """Begin anew, with another view."""
        self._sight = CubeSight.of(self.octree, sight, self._threshold)
        self._done: list[tuple[int, _Nodes]] = []
        self._outside = self._away = 0
        root = self._room("nodes", 0)
        root.places[:] = root.indices[:] = 0
        self._start(0, root.part(0, int(self.octree.counts[0])))

    @property
    def complete(self) -> bool:
        """Whether `advance` would change nothing."""
        return self._at == len(self._nodes)

    @property
    def largest(self) -> float:
        """The edge of the largest node that may still give way to its children, scan units; 0: none may."""
        return 0.0 if self.complete else self.octree.size(self._level)

    def advance(self, budget_ms: float | None = None) -> bool:
        """Go on for about so long, a step at least; None: to the end. Returns whether it is complete."""
        until = math.inf if budget_ms is None else time.perf_counter() + budget_ms / 1e3
        while not self.complete:
            self._step()
            if self._at == len(self._nodes) and self._followed:
                self._start(self._level + 1, self._children.part(0, self._followed))
            if time.perf_counter() >= until:
                break
        return self.complete

    def cut(self, origin: NDArray[np.float64], means: bool = False) -> Cut:
        """The cut so far, its positions relative to this origin, (3,). means: not the centres of the cells,
        but where the surface is in them; the tree has attributes."""
        from . import cut_kernels

        parts = [*self._done, (self._level, self._nodes.part(self._at))]
        if self._followed:
            parts.append((self._level + 1, self._children.part(0, self._followed)))
        parts.sort(key=lambda part: -part[0])
        lengths = [len(nodes) for _, nodes in parts]
        positions = np.empty((sum(lengths), 3), np.float32)
        low, start = self.octree.low - origin, 0
        for level, nodes in parts:
            end = start + len(nodes)
            offsets = self.octree.attributes[level].offsets if means else None
            offsets = _NO_OFFSETS if offsets is None else offsets
            cut_kernels.find_positions(
                nodes.places, nodes.indices, self.octree.size(level), low, offsets, positions[start:end]
            )
            start = end
        levels = np.array([level for level, _ in parts], np.uint8)
        halves = np.array([self.octree.size(level) / 2 for level, _ in parts], np.float32)
        return Cut(
            level=np.repeat(levels, lengths),
            index=np.concatenate([nodes.indices for _, nodes in parts]),
            positions=positions,
            halves=np.repeat(halves, lengths),
            complete=self.complete,
            outside=self._outside,
            facing_away=self._away,
        )

    def _room(self, kind: str, level: int) -> _Nodes:
        """Memory for the nodes of a level, kept, as new pages cost as much as what is written to them."""
        if (kind, level) not in self._rooms:
            count = int(self.octree.counts[level]) if level <= self._depth else 0
            self._rooms[kind, level] = _Nodes.room(count + _SPARE)
        return self._rooms[kind, level]

    def _start(self, level: int, nodes: _Nodes) -> None:
        """Go on with these nodes of a level."""
        self._level, self._nodes, self._at = level, nodes, 0
        self._children, self._followed = self._room("nodes", level + 1), 0
        self._shown, self._kept = self._room("shown", level), 0

    def _step(self) -> None:
        """Look at the next nodes of the level."""
        from . import cut_kernels

        level, last = self._level, self._level == self._depth
        if last and not self._cones and self._nodes.all_within():  # nothing is left to ask
            self._done.append((level, self._nodes))
            self._at = len(self._nodes)
            return
        nodes = self._nodes.part(self._at, self._at + _CHUNK)
        children, shown = self._children.part(self._followed), self._shown.part(self._kept)
        masks, first_child = _NO_MASKS, _NO_CHILDREN
        if not last:
            masks, first_child = self.octree.masks[level], self.octree.first_child[level]
        sight = self._sight
        least = self._threshold if self.octree.size(level) < sight.least else 0.0  # 0: none is so small
        followed, kept, outside, away = cut_kernels.descend(
            cut_kernels.Nodes(nodes.places, nodes.indices),
            self.octree.size(level),
            cut_kernels.LevelArrays(masks, first_child, *self._attributes()),
            cut_kernels.SightArrays(sight.planes, sight.eye, sight.back),
            cut_kernels.SightLens(
                sight.perspective, sight.scale, sight.near, least, float(self._margins[level])
            ),
            cut_kernels.Nodes(children.places, children.indices),
            cut_kernels.Nodes(shown.places, shown.indices),
        )
        self._at, self._followed = self._at + len(nodes), self._followed + followed
        self._outside, self._away = self._outside + outside, self._away + away
        self._kept += kept
        if kept:
            self._done.append((level, shown.part(0, kept)))

    def _attributes(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        found = self.octree.attributes[self._level] if self._cones else None
        if found is None or found.normals is None or found.cones is None:
            return _NO_NORMALS, _NO_CONES
        return found.normals, found.cones


_NO_MASKS, _NO_CHILDREN = np.empty(0, np.uint8), np.empty(0, np.uint32)
_NO_OFFSETS = np.empty((0, 3), np.uint16)
_NO_NORMALS, _NO_CONES = np.empty((0, 3), np.float32), np.empty(0, np.float32)
