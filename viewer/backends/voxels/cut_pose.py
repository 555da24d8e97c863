"""Octants that shaders found, as the points of a pose: the CPU reads them when it is asked about them."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...bounds import Bounds
from ...gpu import gl
from ...gpu.bindings import Storage, Texture, storage
from ...gpu.context import Gpu
from ...gpu.pose import FORMATS, GpuPose
from ...scan.octree import Octree
from ...scan.points import NOTHING, SAMPLE, PointCloud, robust_box, stride, strided, usual_reach
from .shown import CutCounts, ScalarsOfRows, StrayPoints, ids_of

_BYTES = {"positions": 12, "normals": 12, "radii": 4, "colors": 4, "octants": 4}
_KINDS = {"positions": "f4", "normals": "f4", "radii": "f4", "colors": "u1", "octants": "u4"}
_SPARE = 8  # a share of this much more room, so that the next view's octants fit
_POOLED = 2  # arrays that wait for the next views
_FACTS = 32  # bytes before the sample


class CutArrays:
    """Room for what is drawn of so many octants."""

    def __init__(self, gpu: Gpu, room: int, colored: bool) -> None:
        self._gpu, self.room = gpu, room
        self.texels = {
            name: gl.BufferTexture(gpu.buffer(reserve=max(size * room, 16)), FORMATS.get(name, gl.R32UI))
            for name, size in _BYTES.items()
            if colored or name != "colors"
        }
        self.nbytes = sum(texels.buffer.size for texels in self.texels.values())

    def bind(self) -> None:
        """Bind for voxels/tree/gather.comp to write."""
        for name, texels in self.texels.items():
            texels.buffer.bind_to_storage_buffer(storage(f"cut_{name}"))

    def release(self) -> None:
        """Delete everything."""
        self._gpu.discard(*self.texels.values())


class ArrayPool:
    """Arrays of octants that no picture shows any more, for the next ones."""

    def __init__(self, gpu: Gpu, colored: bool) -> None:
        self._gpu, self._colored = gpu, colored
        self._free: list[CutArrays] | None = []

    def take(self, count: int) -> CutArrays:
        """Room for so many octants."""
        fitting = next((each for each in self._free or () if each.room >= count), None)
        if fitting is not None and self._free is not None:
            self._free.remove(fitting)
            return fitting
        return CutArrays(self._gpu, count + count // _SPARE, self._colored)

    def give(self, arrays: CutArrays) -> None:
        """Take back what nothing shows any more; from any thread."""
        free = self._free
        if free is None:
            arrays.release()
            return
        free.append(arrays)
        if len(free) > _POOLED:
            free.pop(0).release()

    def release(self) -> None:
        """Delete the arrays that wait, and those that are given back later."""
        free, self._free = self._free or [], None
        for arrays in free:
            arrays.release()


class CutPose(GpuPose):
    """Octants that shaders found, and strays behind them, as points.

    A picture needs few facts of them, and reads no more. `cloud`, `rows` and `octants` read the arrays.
    """

    MOST_BYTES = max(_BYTES.values())  # of a node in one array

    def __init__(
        self,
        scanned: GpuPose,
        octree: Octree,
        arrays: CutArrays,
        nodes: int,
        strays: StrayPoints,
        found: CutCounts,
        pool: ArrayPool,
    ) -> None:
        cloud = scanned.cloud
        none = np.zeros((0, 3), np.float32)
        overview = PointCloud(
            positions=none,
            origin=scanned.origin,
            normals=none,
            colors=None if cloud.colors is None else np.zeros((0, 4), np.uint8),
            radii=np.zeros(0, np.float32),
            scalars=cloud.scalars,
            ids=np.zeros(0, np.uint32),
        )
        super().__init__(scanned.gpu, replace(scanned.pose, points=overview))
        self.found = found
        self._scanned, self._octree, self._strays = scanned, octree, strays
        self._cut, self._nodes, self._pool = arrays, nodes, pool
        self._write_strays()

    def _write_strays(self) -> None:
        if not len(self._strays.rows):
            return
        for name, texels in self._cut.texels.items():
            values = self._strays._asdict().get(name, np.full(len(self._strays.rows), NOTHING, np.uint32))
            if values is not None:
                texels.buffer.write(np.ascontiguousarray(values), offset=_BYTES[name] * self._nodes)

    @property
    def points(self) -> GpuPose:
        return self

    @property
    def count(self) -> int:
        return self._nodes + len(self._strays.rows)

    def has(self, name: str) -> bool:
        return getattr(self.pose.overview, name) is not None

    def array(self, name: str) -> gl.BufferTexture:
        return self._cut.texels[name] if name in self._cut.texels else super().array(name)

    @property
    def uploaded_bytes(self) -> int:
        return super().uploaded_bytes + self._cut.nbytes

    # --- facts ------------------------------------------------------------------------

    @cached_property
    def whole_bounds(self) -> Bounds:
        return Bounds(*(corner + self.origin for corner in self._facts.box))

    @cached_property
    def bounds(self) -> Bounds:
        if not self.count:
            return Bounds(self.origin - 1, self.origin + 1)
        low, high = robust_box(self._facts.sample[:, :3])
        whole_low, whole_high = self._facts.box
        if (whole_low >= low).all() and (whole_high <= high).all():
            return self.whole_bounds
        box = _find_facts(self, (low, high)).box
        return Bounds(*(corner + self.origin for corner in box))

    @cached_property
    def reaches(self) -> tuple[float, float]:
        return usual_reach(self._facts.sample[:, 3]), self._facts.longest

    @property
    def sample(self) -> NDArray[np.float64]:
        return strided(self.cloud.positions).astype(np.float64)

    @cached_property
    def _facts(self) -> _Facts:
        return _find_facts(self)

    # --- on the CPU -------------------------------------------------------------------

    @cached_property
    def stored(self) -> PointCloud:
        read: dict[str, Any] = {name: self._read(name) for name in self._cut.texels if name != "octants"}
        scalars = ScalarsOfRows(self._scanned.cloud.scalars, self.rows)
        ids = ids_of(self._scanned, self.rows)
        return PointCloud(origin=self.origin, scalars=scalars, ids=ids, **read)

    @cached_property
    def octants(self) -> NDArray[np.uint32]:
        """(n,): the number of each among all of the tree, NOTHING of strays."""
        return self._read("octants")

    @cached_property
    def rows(self) -> NDArray[np.uint32]:
        """(n,): the first point of each."""
        first = np.concatenate([level.rows for level in self._octree.attributes])
        return np.concatenate([first[self.octants[: self._nodes]], self._strays.rows])

    def _read(self, name: str) -> NDArray:
        kind = np.dtype(_KINDS[name])
        numbers = _BYTES[name] // kind.itemsize
        read = self.gpu.read(self._cut.texels[name].buffer, kind, numbers * self.count)
        return read.reshape(self.count, numbers) if numbers > 1 else read

    def __del__(self) -> None:
        super().__del__()
        if hasattr(self, "_pool"):
            self._pool.give(self._cut)


class _Facts:
    """The box round points, (low, high) relative to their origin, float32; the longest radius; some of the
    points, position and radius, (m, 4)."""

    def __init__(self, words: NDArray[np.uint32], sampled: int) -> None:
        corners = _floats(words[:6]).reshape(2, 3)
        self.box = corners[0], corners[1]
        self.longest = float(words[6:7].view(np.float32)[0])
        self.sample = words[8:].view(np.float32).reshape(-1, 4)[:sampled]


def _find_facts(pose: CutPose, inside: tuple[NDArray, NDArray] | None = None) -> _Facts:
    """Facts of points; inside: of those in a box, but no sample."""
    gpu, count = pose.gpu, pose.count
    step = stride(count)
    sampled = 0 if inside else -(-count // step)
    buffer = gpu.cached(_facts_buffer)
    buffer.write(np.array([*[NOTHING] * 3, *[0] * 5], np.uint32))
    program = gpu.compute("voxels/tree/facts.comp", {"INSIDE": int(inside is not None)})
    with gpu.timers.measure("facts"):
        pose.array("positions").bind(Texture.POSITIONS)
        pose.array("radii").bind(Texture.RADII)
        buffer.bind_to_storage_buffer(Storage.CUT_FACTS)
        if inside is None:
            gpu.set(program, stride=step)
        else:
            gpu.set(program, inside_low=tuple(inside[0].tolist()), inside_high=tuple(inside[1].tolist()))
        gpu.dispatch(program, count)
        words = gpu.read(buffer, np.uint32, _FACTS // 4 + 4 * sampled)
    return _Facts(words, sampled)


def _facts_buffer(gpu: Gpu) -> moderngl.Buffer:
    return gpu.buffer(reserve=_FACTS + 16 * 2 * SAMPLE)


def _floats(words: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Numbers of words that have the same order."""
    negative = words < 1 << 31
    return np.where(negative, ~words, words ^ np.uint32(1 << 31)).view(np.float32)
