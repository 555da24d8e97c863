"""Targets: the picture at half, a quarter, ... of its size, with the nearest sample of each cell."""

from __future__ import annotations

from collections.abc import Sequence

from ..gpu import gl
from ..gpu.bindings import Storage, Texture, texture
from ..gpu.blocks import Values
from ..gpu.compact import IndexList
from ..gpu.context import Gpu
from ..gpu.pyramid import sizes
from ..picture.surface import Surface
from .sources import SampleSource

LEVELS = 5  # of targets, the picture among them (Farooq 2013, 4.3.1)


class Targets:
    """Depths and samples of the cells of all levels but the first, which is the Surface itself.

    Samples that fall into a pixel fall into the cell that it lies in, so that a target is made of the one
    before it, not of the samples.
    """

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._gpu = gpu
        self._sizes = sizes(size, LEVELS)
        cells = sum(width * height for width, height in self._sizes[1:])
        self.keys, self.best = (_texels(gpu, cells, gl.R32UI, 4) for _ in range(2))
        self._sample_positions = _texels(gpu, cells, gl.RG32F, 8)
        edge = 1 << (LEVELS - 1)
        self.holes = IndexList(gpu, self._sizes[-1][0] * self._sizes[-1][1], edge * edge)
        self._shown = _texels(gpu, cells, gl.RGBA32UI, 16)

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return (
            sum(each.buffer.size for each in (self.keys, self.best, self._sample_positions, self._shown))
            + self.holes.nbytes
        )

    def bind(self) -> None:
        """Bind depths and samples for shaders to fetch."""
        self.keys.bind(Texture.KEYS)
        self.best.bind(Texture.BEST)
        self._sample_positions.bind(Texture.SPOTS)
        self._shown.bind(Texture.SHOWN)

    def reduce(self, surface: Surface, source: SampleSource, channels: Sequence[str]) -> None:
        """Make all levels of what the Surface's pixels show. channels: what pixels show."""
        gpu = self._gpu
        self.keys.buffer.bind_to_storage_buffer(Storage.KEYS)
        self.best.buffer.bind_to_storage_buffer(Storage.BEST)
        self._sample_positions.buffer.bind_to_storage_buffer(Storage.SPOTS)
        self._shown.buffer.bind_to_storage_buffer(Storage.SHOWN)
        with gpu.timers.measure("reduce"):
            for level, (width, height) in enumerate(self._sizes[1:], 1):
                first = level == 1
                program = gpu.compute(
                    "pyramidal/reduce.comp",
                    {"FIRST": int(first), **source.defines(channels)},
                    source.parts,
                    source.params,
                )
                if first:
                    source.bind()
                    surface.depths.bind(Texture.KEYS)
                    surface.rows.bind(Texture.BEST)
                    for name in channels:
                        surface.own(name).bind(texture(f"own_{name}s"))
                else:
                    self.bind()
                gpu.set(program, level=level)
                gpu.dispatch(program, width * height)

    def list_holes(self, params: Values) -> IndexList:
        """List the cells of the coarsest level in which pixels may be filled, with an invocation a pixel."""
        width, height = self._sizes[-1]
        with self._gpu.timers.measure("holes"):
            program = self._gpu.compute("pyramidal/holes.comp", params=params)
            self.holes.clear()
            self.holes.bind()
            self.bind()
            self._gpu.dispatch(program, width * height)
        return self.holes

    def read_holes(self) -> dict[str, int]:
        """Numbers of cells of the coarsest level: in which pixels may be filled, and of the others."""
        cells, filled = self.holes.capacity, len(self.holes) // (1 << 2 * (LEVELS - 1))
        return {"filled": filled, "left": cells - filled}

    def release(self) -> None:
        """Delete them."""
        self._gpu.discard(self.keys, self.best, self._sample_positions, self._shown, self.holes)


def _texels(gpu: Gpu, count: int, texel_format: int, size: int) -> gl.BufferTexture:
    return gl.BufferTexture(gpu.buffer(reserve=size * max(count, 1)), texel_format)
