"""Point spread functions: each sample as a Gaussian over a few pixels (Farooq 2013, chapter 5)."""

from __future__ import annotations

from collections.abc import Callable
from math import erf

import numpy as np

from ..gpu import gl
from ..gpu.bindings import Texture
from ..gpu.context import Gpu
from ..gpu.scatter import CellSums, FixedPoint, Visits
from ..picture.surface import Surface

FUNCTIONS = ("off", "table", "analytic")  # as placing.glsl numbers them
KERNELS = ("3x3", "5x5")
_STEPS = 100  # offsets of the table along either axis, of a pixel
_SPREAD = 0.5  # pixels, the standard deviation
_FINEST = 2.0**-16


class Spread:
    """The sums of a picture's point spread functions: weight, and weight times linear colour."""

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._gpu = gpu
        self.sums = CellSums(gpu, size[0] * size[1], 4)
        self.texels = gl.BufferTexture(self.sums.buffer, gl.R32UI)

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return self.sums.nbytes

    def release(self) -> None:
        """Delete them."""
        self._gpu.discard(self.texels)  # and its buffer


def spread_macros(mode: str, kernel: str, count: int) -> dict[str, object]:
    """Macros of shaders that add such functions of so many samples, or read their sums."""
    number = FUNCTIONS.index(mode)
    if not number:
        return {"SUMS": 0}
    return {"SUMS": number, "KERNEL": int(kernel[0]), "KERNEL_STEPS": _STEPS, **_fixed(count).defines}


def add_spread(surface: Surface, visits: Visits, kernel: str, count: int) -> Spread:
    """Add the functions of samples that were scattered. visits: of the samples, by placing.glsl."""
    gpu = surface.gpu
    made = surface.cached(Spread)
    made.sums.clear()
    surface.depths.bind(Texture.DEPTHS)
    gpu.cached(_table, int(kernel[0])).bind(Texture.KERNELS)
    with gpu.timers.measure("spread"):
        made.sums.add(visits, _fixed(count))
    return made


def _fixed(count: int) -> FixedPoint:
    return FixedPoint((1.0,) * 4, (_FINEST,) * 4, max(count, 1))


def _table(gpu: Gpu, size: int) -> gl.BufferTexture:
    """Kernels of size x size pixels for offsets from -0.5 to 0.5, in rows: weights whose sum lacks of 1 what
    lies farther out."""
    offsets = (np.arange(_STEPS) + 0.5) / _STEPS - 0.5
    along = np.array([_weights(offset, size, erf) for offset in offsets])
    kernels = along[:, None, :, None] * along[None, :, None, :]
    return gl.BufferTexture(gpu.buffer(kernels.astype(np.float32)), gl.R32F)


def _weights(offset: float, size: int, integral: Callable[[float], float]) -> list[float]:
    edges = np.arange(size + 1) - size / 2 - offset
    below = [0.5 * integral(float(edge) / (_SPREAD * np.sqrt(2))) for edge in edges]
    return np.diff(below).tolist()
