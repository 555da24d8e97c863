"""An octree on the GPU: which of its nodes a view shows is found by shaders (shaders/voxels/tree/)."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...gpu import gl
from ...gpu.bindings import Storage, Texture
from ...gpu.constants import GROUP
from ...gpu.context import Gpu
from ...gpu.pose import GpuPose
from ...scan.octree import DEEPEST, Octree
from ...scan.octree.traverse import CubeSight, Sight
from .cut_pose import ArrayPool, CutArrays, CutPose
from .shown import CutCounts, ShownOctants, StrayPoints

_LEVELS = DEEPEST + 1
_HALF_DIAGONAL = f"{math.sqrt(3) / 2!r}LF"  # of a cube of edge 1
_CELL_BYTES, _LISTED_BYTES = 8, 8
# What voxels/tree/sight.glsl declares.
_LEVEL = np.dtype([("edge", "f8"), ("margin", "f8"), ("least", "f8"), ("start", "u4"), ("last", "u4")])
_SIGHT = np.dtype(
    [
        *(("planes", "f8", 24), ("eye", "f8", 3), ("back", "f8", 3), ("scale", "f8"), ("near", "f8")),
        *(("low", "f8", 3), ("plane_count", "u4"), ("is_perspective", "u4"), ("levels", _LEVEL, _LEVELS)),
    ]
)
_TOTALS = np.dtype(
    [("groups", "u4", 3), ("count", "u4", 2), ("outside", "u4"), ("facing_away", "u4"), ("spare", "u4"),
     ("shown", "u4", _LEVELS)]
)  # fmt: skip
# Arrays of all nodes, what a node has of each and its bytes; the deepest level has none of `_INNER`.
_ARRAYS = {
    "masks": (gl.R8UI, 1),
    "first_child": (gl.R32UI, 4),
    "offsets": (gl.R16UI, 6),
    "radii": (gl.R32F, 4),
    "normals": (gl.RGB32F, 12),
    "colors": (gl.R32UI, 4),
    "cones": (gl.R32F, 4),
}
_INNER = ("masks", "first_child")
_Slice = tuple[int, gl.BufferTexture | None, int, NDArray[np.uint8]]


@dataclass(frozen=True, eq=False)
class CutOptions:
    """See `Traversal`, whose arguments have these names."""

    pixel_threshold: float
    max_depth: int
    cull_cones: bool
    margins: Sequence[float]


class _Scratch:
    """Lists for the time while nodes are found, which all octrees share. nodes: two, those of a level and
    those of the next. shown: the nodes that are shown."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._level_nodes = self._all_nodes = 0
        self.sight = gpu.buffer(reserve=_SIGHT.itemsize)
        self.totals = gpu.buffer(reserve=_TOTALS.itemsize)

    def reserve(self, level_nodes: int, all_nodes: int) -> None:
        """Room for so many nodes of one level, and of all."""
        gpu = self._gpu
        if level_nodes > self._level_nodes:
            self._level_nodes = level_nodes
            blocks = -(-level_nodes // GROUP) + 1
            self.nodes = [gpu.buffer(reserve=_LISTED_BYTES * level_nodes) for _ in range(2)]
            self.block_counts, self.block_starts = (gpu.buffer(reserve=n * blocks) for n in (4, 8))
        if all_nodes > self._all_nodes:
            self._all_nodes = all_nodes
            self.shown = gl.BufferTexture(gpu.buffer(reserve=4 * all_nodes), gl.R32UI)


class GpuOctree:
    """The nodes of an octree with attributes, uploaded level by level. `show` finds those that a view shows.

    Bit by bit and in the same order, these are the nodes that `Traversal` finds.
    """

    def __init__(self, gpu: Gpu, octree: Octree) -> None:
        self._gpu, self._octree = gpu, octree
        counts = octree.counts
        self._starts = (np.cumsum(counts) - counts).tolist()
        self._count = int(counts.sum())
        self._texels = {
            name: gl.BufferTexture(gpu.buffer(reserve=max(size * self._nodes_of(name), 16)), texels)
            for name, (texels, size) in _ARRAYS.items()
            if self._has(name)
        }
        self._cells = gl.BufferTexture(gpu.buffer(reserve=_CELL_BYTES * self._count), gl.RG32UI)
        self._cells.buffer.write(bytes(_CELL_BYTES))  # the root's
        self._slices = deque(self._list_slices())
        self._ready = 0  # levels
        self._pool = ArrayPool(gpu, "colors" in self._texels)
        self.nbytes = _CELL_BYTES * self._count + sum(t.buffer.size for t in self._texels.values())

    @staticmethod
    def fits(gpu: Gpu, octree: Octree) -> bool:
        """Whether shaders can see as many nodes, and there are any."""
        nodes = int(octree.counts.sum())
        return bool(octree.points) and max(_CELL_BYTES, CutPose.MOST_BYTES) * nodes <= gpu.max_storage_bytes

    def _has(self, name: str) -> bool:
        return name in _INNER or getattr(self._octree.attributes[0], name) is not None

    def _nodes_of(self, name: str) -> int:
        return self._starts[-1] if name in _INNER else self._count

    def _list_slices(self) -> list[_Slice]:
        """Slices to upload, in order: (level, buffer, first byte there, bytes). The buffer is None at the end
        of each level."""
        octree, size = self._octree, self._gpu.staging.slice
        slices: list[_Slice] = []
        for level in range(octree.depth + 1):
            for name, texels in self._texels.items():
                if name in _INNER and level == octree.depth:
                    continue
                of = getattr(octree, name) if name in _INNER else None
                values = getattr(octree.attributes[level], name) if of is None else of[level]
                words = np.ascontiguousarray(values).reshape(-1).view(np.uint8)
                first = _ARRAYS[name][1] * self._starts[level]
                slices += [
                    (level, texels, first + at, words[at : at + size]) for at in range(0, len(words), size)
                ]
            slices.append((level, None, 0, np.empty(0, np.uint8)))
        return slices

    @property
    def is_complete(self) -> bool:
        """Whether all levels are there."""
        return not self._slices

    def largest(self, max_depth: int) -> float:
        """The edge of the largest octants that may give way once more levels are there, scan units; 0: none
        may. max_depth: the deepest level to draw."""
        wanted = max(0, min(max_depth, self._octree.depth))
        return 0.0 if self._ready > wanted else self._octree.size(max(self._ready - 1, 0))

    def upload(self, budget_ms: float | None = None) -> int:
        """Upload for about so long: a slice at least, and the root with the first call; None: all. Returns
        how many bytes."""
        end = math.inf if budget_ms is None else time.perf_counter() + budget_ms / 1e3
        uploaded = 0
        while self._slices:
            level, texels, first, words = self._slices.popleft()
            if texels is not None:
                self._gpu.staging.write(texels.buffer, words, first)
                uploaded += len(words)
            else:
                self._finish(level)
            if self._ready and time.perf_counter() >= end:
                break
        return uploaded

    def _finish(self, level: int) -> None:
        """Go on after all of a level is there."""
        if level < self._octree.depth:
            self._find_cells(level)
        self._ready = level + 1

    def _find_cells(self, level: int) -> None:
        """The cells of the children of a level's nodes."""
        gpu = self._gpu
        program = gpu.compute("voxels/tree/cells.comp")
        with gpu.timers.measure("cells"):
            self._bind_tree()
            self._cells.buffer.bind_to_storage_buffer(Storage.NODE_CELLS)
            gpu.set(program, start=self._starts[level], next_start=self._starts[level + 1])
            gpu.dispatch(program, int(self._octree.counts[level]))

    def _bind_tree(self) -> None:
        self._texels["masks"].bind(Texture.NODE_MASKS)
        self._texels["first_child"].bind(Texture.FIRST_CHILDREN)
        self._cells.bind(Texture.NODE_CELLS)

    def show(
        self,
        pose: GpuPose,
        strays: StrayPoints,
        sight: Sight,
        options: CutOptions,
        coarseness: float = 0.0,
    ) -> ShownOctants:
        """The nodes that a view shows, of the levels that are there, and the strays, as points of a pose.
        coarseness: see `CutCounts`."""
        gpu, wanted = self._gpu, max(0, min(options.max_depth, self._octree.depth))
        depth = min(wanted, self._ready - 1)
        scratch = gpu.cached(_Scratch)
        scratch.reserve(int(self._octree.counts[: depth + 1].max()), self._count)
        with gpu.timers.measure("cut"):
            scratch.sight.write(self._pack(pose, sight, options, depth))
            scratch.totals.write(bytes(_TOTALS.itemsize))
            cones = options.cull_cones and "cones" in self._texels
            self._descend(scratch, depth, cones)
            totals = gpu.read(scratch.totals).view(_TOTALS)[0]
            counts = totals["shown"]
            count = int(counts.sum(dtype=np.int64))
            arrays = self._pool.take(count + len(strays.rows))
            if count:
                self._gather(scratch, arrays, count)
        levels = np.flatnonzero(counts)
        coarsest = int(levels[0]) if len(levels) else self._octree.depth
        outside, away = int(totals["outside"]), int(totals["facing_away"])
        found = CutCounts(depth == wanted, outside, away, coarsest, coarseness)
        return CutPose(pose, self._octree, arrays, count, strays, found, self._pool)

    def _pack(self, pose: GpuPose, sight: Sight, options: CutOptions, depth: int) -> bytes:
        """The view as voxels/tree/sight.glsl declares it."""
        octree, of = self._octree, CubeSight.of(self._octree, sight, options.pixel_threshold)
        words = np.zeros(1, _SIGHT)
        one = words[0]
        one["planes"][: of.planes.size] = of.planes.ravel()
        one["eye"], one["back"], one["low"] = of.eye, of.back, octree.low - pose.origin
        one["scale"], one["near"] = of.scale, of.near if of.perspective else 1.0
        one["plane_count"], one["is_perspective"] = len(of.planes), of.perspective
        one["levels"][: octree.depth + 1] = [
            (
                octree.size(level),
                options.margins[level],
                options.pixel_threshold if octree.size(level) < of.least else 0.0,
                self._starts[level],
                level == depth,
            )
            for level in range(octree.depth + 1)
        ]
        return words.tobytes()

    def _descend(self, scratch: _Scratch, depth: int, cones: bool) -> None:
        """List the nodes that are shown, level after level."""
        gpu = self._gpu
        defines = {"CONES": int(cones), "HALF_DIAGONAL": _HALF_DIAGONAL}
        begin, add_up, divide = (
            gpu.compute("voxels/tree/descend.comp", {"STEP": step, **defines}) for step in range(3)
        )
        self._bind_tree()
        if cones:
            self._texels["normals"].bind(Texture.NORMALS)
            self._texels["cones"].bind(Texture.CONES)
        scratch.sight.bind_to_storage_buffer(Storage.SIGHT)
        scratch.totals.bind_to_storage_buffer(Storage.CUT_TOTALS)
        scratch.shown.buffer.bind_to_storage_buffer(Storage.SHOWN_NODES)
        scratch.block_counts.bind_to_storage_buffer(Storage.BLOCK_COUNTS)
        scratch.block_starts.bind_to_storage_buffer(Storage.BLOCK_STARTS)
        scratch.nodes[0].bind_to_storage_buffer(Storage.CHILDREN)
        gpu.dispatch(begin, 1)
        for level in range(depth + 1):
            for program in (add_up, divide):
                gpu.set(program, level=level)
            gpu.dispatch(add_up, GROUP)
            scratch.nodes[level % 2].bind_to_storage_buffer(Storage.NODES)
            scratch.nodes[1 - level % 2].bind_to_storage_buffer(Storage.CHILDREN)
            gpu.dispatch_indirect(divide, scratch.totals)

    def _gather(self, scratch: _Scratch, arrays: CutArrays, count: int) -> None:
        """Put together what is drawn of the shown nodes."""
        gpu, colored = self._gpu, "colors" in self._texels
        program = gpu.compute("voxels/tree/gather.comp", {"COLORED": int(colored)})
        self._cells.bind(Texture.NODE_CELLS)
        scratch.shown.bind(Texture.LISTED)
        for name, unit in (
            ("offsets", Texture.NODE_OFFSETS),
            ("radii", Texture.RADII),
            ("normals", Texture.NORMALS),
            ("colors", Texture.NODE_COLORS),
        ):
            if name in self._texels:
                self._texels[name].bind(unit)
        scratch.sight.bind_to_storage_buffer(Storage.SIGHT)
        scratch.totals.bind_to_storage_buffer(Storage.CUT_TOTALS)
        arrays.bind()
        gpu.dispatch(program, count)

    def release(self) -> None:
        """Delete what it holds on the GPU, but what is still shown."""
        self._pool.release()
        self._gpu.discard(*self._texels.values(), self._cells)
