"""The least that a picture of points can cost on a device: a plain scatter, GL_POINTS, a CUDA kernel.

None of them tests, counts, shades or keeps anything."""

from __future__ import annotations

import time
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from experiments.speed.points import PlainPoints, clip_of
from viewer.gpu.context import Gpu
from viewer.scan.points import PointCloud
from viewer.view import View

_HERE = Path(__file__).parent
_GROUP, _MOST_GROUPS = 128, 65_535


class Sketch:
    """A compute scatter. bits: 64 keeps depth and point in one word, 32 takes two passes. radius: scan units
    of discs that face the camera; 0 draws points. Raises moderngl.Error where the driver has no such
    atomics."""

    def __init__(
        self, gpu: Gpu, cloud: PointCloud, size: tuple[int, int], bits: int, radius: float = 0.0
    ) -> None:
        self.gpu, self.size, self.bits, self.radius = gpu, size, bits, radius
        self.count, pixels = len(cloud), size[0] * size[1]
        text = (_HERE / "sketch.comp").read_text(encoding="utf-8")
        self.steps = []
        for step in range(3):
            defines = {"BITS": bits, "STEP": step, "DISCS": int(radius > 0)}
            head = "".join(f"#define {name} {value}\n" for name, value in defines.items())
            program = gpu.ctx.compute_shader(f"#version {430 if bits == 32 else 450} core\n{head}{text}")
            is_of_pixels = step == 0 or (step == 2 and bits == 64)
            self.steps.append((program, pixels if is_of_pixels else self.count))
        self.positions, self.colors = gpu.ctx.buffer(cloud.positions), gpu.ctx.buffer(cloud.colors)
        self.keys = gpu.ctx.buffer(reserve=pixels * bits // 8)
        self.picture = gpu.ctx.buffer(reserve=4 * pixels)
        self.out = np.empty(4 * pixels, np.uint8)

    def fill(self, cloud: PointCloud) -> None:
        """Replace the points by as many others."""
        self.positions.write(cloud.positions)
        self.colors.write(cloud.colors)

    def submit(self, view: View) -> None:
        """Draw, without waiting."""
        for binding, buffer in enumerate((self.positions, self.colors, self.keys, self.picture)):
            buffer.bind_to_storage_buffer(binding)
        values = {"to_clip": clip_of(view).T.astype(np.float32).tobytes(), "size": self.size}
        for program, count in self.steps:
            known = {**values, "count": count, "radius": self.radius * view.scale}
            for name, value in known.items():
                if name in program and name == "to_clip":
                    program[name].write(value)  # type: ignore[union-attr]
                elif name in program:
                    program[name] = value
            groups = -(-count // _GROUP)
            program.run(min(groups, _MOST_GROUPS), -(-groups // _MOST_GROUPS))
            self.gpu.ctx.memory_barrier()

    def read(self) -> None:
        """Read the picture."""
        self.picture.read_into(self.out)

    def release(self) -> None:
        """Delete its buffers."""
        for buffer in (self.positions, self.colors, self.keys, self.picture):
            buffer.release()


class GlPoints(PlainPoints):
    """GL_POINTS from another view in each picture."""

    def __init__(self, gpu: Gpu, cloud: PointCloud, view: View) -> None:
        super().__init__(gpu.ctx, cloud, view)

    def submit(self, view: View) -> None:
        """Draw, without waiting."""
        self.aim(view)
        self.render()

    def release(self) -> None:
        """Delete what it draws with."""
        self.vertices.release()
        self.target.release()


class CudaScatter:
    """The scatter as a CUDA kernel, by CuPy. Raises ImportError without CuPy."""

    def __init__(self, cloud: PointCloud, size: tuple[int, int], radius: float = 0.0) -> None:
        cupy = import_module("cupy")

        self.cupy = cupy
        self.size, self.count, self.radius = size, len(cloud), np.float32(radius)
        self.pixels = size[0] * size[1]
        module = cupy.RawModule(code=(_HERE / "sketch.cu").read_text(encoding="utf-8"))
        self.clear, self.scatter, self.resolve = map(module.get_function, ("clear", "scatter", "resolve"))
        self.positions = cupy.asarray(cloud.positions)
        assert cloud.colors is not None
        self.colors = cupy.asarray(np.ascontiguousarray(cloud.colors).view(np.uint32).ravel())
        self.keys = cupy.empty(self.pixels, cupy.uint64)
        self.picture = cupy.empty(self.pixels, cupy.uint32)
        pinned = cupy.cuda.alloc_pinned_memory(4 * self.pixels)
        self.out: NDArray = np.frombuffer(pinned, np.uint32, self.pixels)

    def submit(self, view: View) -> None:
        """Draw, without waiting."""
        matrix = self.cupy.asarray(clip_of(view).astype(np.float32).ravel())
        pixels, (width, height) = np.int32(self.pixels), map(np.int32, self.size)
        of_pixels, of_points = ((-(-count // 256),) for count in (self.pixels, self.count))
        self.clear(of_pixels, (256,), (self.keys, pixels))
        radius = np.float32(self.radius * view.scale)
        given = (self.positions, matrix, self.keys, np.int64(self.count), width, height, radius)
        self.scatter(of_points, (256,), given)
        self.resolve(of_pixels, (256,), (self.keys, self.colors, self.picture, pixels))

    def passes(self, view: View) -> float:
        """Milliseconds on the GPU, by events."""
        events = [self.cupy.cuda.Event() for _ in range(2)]
        events[0].record()
        self.submit(view)
        events[1].record()
        events[1].synchronize()
        return float(self.cupy.cuda.get_elapsed_time(*events))

    def finish(self) -> None:
        """Wait for the GPU."""
        self.cupy.cuda.runtime.deviceSynchronize()

    def read(self) -> None:
        """Read the picture into memory that the driver holds in place."""
        self.picture.get(out=self.out)

    def release(self) -> None:
        """Free its memory."""
        self.positions = self.colors = self.keys = self.picture = None
        self.cupy.get_default_memory_pool().free_all_blocks()


def has_cuda() -> bool:
    """Whether CuPy is there."""
    return find_spec("cupy") is not None


def elapsed_ms(gpu: Gpu, work: Any) -> float:
    """Milliseconds that a work takes on the GPU: by a query, between finishes on software drivers."""
    if gpu.software:
        gpu.ctx.finish()
        start = time.perf_counter()
        work()
        gpu.ctx.finish()
        return 1e3 * (time.perf_counter() - start)
    query: moderngl.Query = gpu.ctx.query(time=True)
    with query:
        work()
    return query.elapsed * 1e-6
