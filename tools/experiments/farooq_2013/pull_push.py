"""Image reconstruction of points by pull and push, as a contender (Marroquim, Kraus and Cavalcanti 2007).

Each point is one pixel: a disc with an interval of depth. Pull averages the cells of a level into the next,
push fills empty cells from the coarser level. Both take only cells whose ellipse holds the middle of the cell
that is written, and whose depth lies in the interval of the nearest such cell. The paper is not at hand: the
steps are those of its abstract and of the authors' shaders (thejdeep/pyramid-point-renderer), with their four
cells, weights 9/16, 3/16, 3/16 and 1/16 for push, and equal ones for pull. The same arithmetic runs as a
compute shader and on the CPU."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from viewer.backends import Backend, FrameView
from viewer.bench.baselines import NoParams
from viewer.gpu.context import Gpu
from viewer.gpu.pose import GpuPose
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.srgb import linear_from_bytes
from viewer.view import View

CELL = 12  # numbers of a cell: see pull_push_kernels.py
_GROUP, _MOST_GROUPS = 128, 65_535
_CLEAR, _NEAREST, _FIRST, _CELLS, _PULL, _PUSH, _PICTURE = range(7)  # steps of the shader
Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Levels:
    """Sizes of all levels, the picture first, and where the cells of each begin."""

    sizes: list[tuple[int, int]]
    starts: list[int]

    @classmethod
    def of(cls, size: tuple[int, int]) -> Levels:
        """Levels down to a single cell."""
        sizes, starts = [size], [0]
        while max(sizes[-1]) > 1:
            starts.append(starts[-1] + sizes[-1][0] * sizes[-1][1])
            sizes.append(((sizes[-1][0] + 1) // 2, (sizes[-1][1] + 1) // 2))
        return cls(sizes, starts)

    @property
    def count(self) -> int:
        """Cells of all levels; the last has one."""
        return self.starts[-1] + 1


def points_of(cloud: PointCloud) -> Floats:
    """(N, 10): positions, normals, linear colours, white where a cloud has none, and radii."""
    assert cloud.normals is not None and cloud.radii is not None
    colors = np.ones((len(cloud), 3)) if cloud.colors is None else linear_from_bytes(cloud.colors[:, :3])
    return np.concatenate(
        [cloud.positions, cloud.normals, colors, cloud.radii[:, None]], axis=1, dtype=np.float32
    )


def view_rows(view: View) -> Floats:
    """(3, 5): rotation, translation, and in the last column the centre and the scale, negative for parallel
    rays."""
    scale = view.scale if view.perspective else -view.scale
    last = [*view.center, scale]
    return np.column_stack([view.rotation, view.translation, last]).astype(np.float32)


def reconstructed(points: Floats, view: View) -> Floats:
    """The cells of a picture, (H, W, 12), on the CPU. points: see `points_of`."""
    from experiments.farooq_2013 import pull_push_kernels as kernels

    levels = Levels.of(view.size)
    cells = np.zeros((levels.count, CELL), np.float32)
    kernels.project(points, view_rows(view), view.size, cells)
    steps = list(pairwise(zip(levels.starts, levels.sizes, strict=True)))
    for level, ((fine, fine_size), (start, size)) in enumerate(steps):
        kernels.pull(cells, fine, fine_size, start, size, np.float32(2 << level))
    for level, ((start, size), (coarse, coarse_size)) in reversed(list(enumerate(steps))):
        kernels.push(cells, start, size, coarse, coarse_size, np.float32(1 << level))
    width, height = view.size
    return cells[: width * height].reshape(height, width, CELL)


def differences(first: Floats, second: Floats) -> dict[str, float]:
    """How far cells (H, W, 12) of two pictures differ. pixels: percent that differ at all. covered: percent
    that one alone covers. depth: the largest difference relative to the depth. color, normal: the largest
    difference of a channel."""
    covered = np.isfinite(first[..., 0]), np.isfinite(second[..., 0])
    both = covered[0] & covered[1]
    one, other = first[both].astype(np.float64), second[both].astype(np.float64)
    off, same = np.abs(one - other), (one == other).all(axis=1)
    differing = np.count_nonzero(covered[0] != covered[1]) + np.count_nonzero(~same)
    return {
        "pixels": 100 * differing / both.size,
        "covered": 100 * float(np.mean(covered[0] != covered[1])),
        "depth": float((off[:, 11] / other[:, 11]).max(initial=0)),
        "color": float(off[:, 8:11].max(initial=0)),
        "normal": float(off[:, 5:8].max(initial=0)),
    }


class Reconstruction:
    """Draws on the GPU. points: see `points_of`."""

    def __init__(self, gpu: Gpu, points: Floats, size: tuple[int, int]) -> None:
        self.gpu, self.count, self.levels = gpu, len(points), Levels.of(size)
        text = Path(__file__).with_name("pull_push.comp").read_text(encoding="utf-8")
        self._steps = [
            gpu.ctx.compute_shader(f"#version 430 core\n#define STEP {step}\n{text}") for step in range(7)
        ]
        self.size, pixels = size, size[0] * size[1]
        self.cells = gpu.ctx.buffer(reserve=4 * CELL * self.levels.count)
        self._buffers = [
            gpu.ctx.buffer(points), *(gpu.ctx.buffer(reserve=4 * pixels) for _ in range(2)), self.cells
        ]  # fmt: skip

    def draw(self, view: View) -> None:
        """Find the cells of a picture, without waiting."""
        for binding, buffer in enumerate(self._buffers):
            buffer.bind_to_storage_buffer(binding)
        size, seen = self.size, {"view": view_rows(view)}
        pixels = size[0] * size[1]
        with self.gpu.timers.measure("project"):
            self._run(_CLEAR, pixels)
            self._run(_NEAREST, self.count, size=size, **seen)
            self._run(_FIRST, self.count, size=size, **seen)
            self._run(_CELLS, pixels, size=size, **seen)
        steps = list(pairwise(zip(self.levels.starts, self.levels.sizes, strict=True)))
        with self.gpu.timers.measure("pull"):
            for level, (fine, coarse) in enumerate(steps):
                self._merge(_PULL, coarse, fine, 2.0 * (1 << level))
        with self.gpu.timers.measure("push"):
            for level, (fine, coarse) in reversed(list(enumerate(steps))):
                self._merge(_PUSH, fine, coarse, float(1 << level))

    def read(self) -> Floats:
        """The cells of the picture, (H, W, 12)."""
        width, height = self.size
        read = self.cells.read(size=4 * CELL * width * height)
        return np.frombuffer(read, np.float32).reshape(height, width, CELL)

    def show(self, surface: Surface) -> None:
        """Write the cells of the picture to a surface of its size."""
        self.cells.bind_to_storage_buffer(3)
        written = (surface.depths, surface.rows, surface.own("color"), surface.own("normal"))
        for binding, texels in enumerate(written, 4):
            texels.buffer.bind_to_storage_buffer(binding)
        with self.gpu.timers.measure("show"):
            self._run(_PICTURE, surface.size[0] * surface.size[1], view=view_rows(surface.view))

    def _merge(
        self, step: int, out: tuple[int, tuple[int, int]], read: tuple[int, tuple[int, int]], edge: float
    ) -> None:
        (start, size), (other, other_size) = out, read
        given = {"size": size, "other_size": other_size, "start": start, "other": other, "edge": edge}
        self._run(step, size[0] * size[1], **given)

    def _run(self, step: int, count: int, **values: Any) -> None:
        program = self._steps[step]
        for name, value in {**values, "count": count}.items():
            if name in program:
                uniform = program[name]
                assert isinstance(uniform, moderngl.Uniform)
                if isinstance(value, np.ndarray):
                    uniform.write(value.ravel()[: uniform.array_length].tobytes())  # drivers cut unused ends
                else:
                    uniform.value = value
        groups = -(-count // _GROUP)
        program.run(min(groups, _MOST_GROUPS), -(-groups // _MOST_GROUPS))
        self.gpu.ctx.memory_barrier()

    def release(self) -> None:
        """Delete its buffers and programs."""
        for buffer in self._buffers:
            buffer.release()
        for program in self._steps:
            program.release()


class CellsBackend(Backend):
    """A contender that draws cells. on_cpu: makes of points what finds the cells of a view, on the CPU; None:
    the compute shader finds them."""

    title = "Cells"
    params_class = NoParams

    def __init__(self, name: str, on_cpu: Callable[[Floats], Callable[[View], Floats]] | None = None) -> None:
        super().__init__(name)
        self._on_cpu = on_cpu
        self._known: tuple[GpuPose, Callable[[View], Floats] | None, Reconstruction] | None = None

    def needs(self, pose: Pose, params: NoParams) -> tuple[str, ...]:
        """Normals and radii of discs."""
        return ("normals", "radii")

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Find the cells and show them; always complete."""
        if self._known is None or self._known[0] is not pose or self._known[2].size != surface.size:
            if self._known is not None:
                self._known[2].release()
            points = points_of(pose.cloud)
            find = self._on_cpu(points) if self._on_cpu else None
            self._known = pose, find, Reconstruction(pose.gpu, points, surface.size)
        _, find, drawn = self._known
        if find is None:
            drawn.draw(surface.view)
        else:
            with pose.gpu.timers.measure("on the CPU"):
                drawn.cells.write(find(surface.view))
        drawn.show(surface)
        return False


def pull_push() -> CellsBackend:
    """The contender as a compute shader."""
    return CellsBackend("pull-push")


def pull_push_on_cpu() -> CellsBackend:
    """The contender on the CPU; the GPU shows the cells."""
    return CellsBackend("pull-push on the CPU", lambda points: partial(reconstructed, points))
