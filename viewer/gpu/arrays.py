"""An array on the GPU: uploaded in slices, shared by poses, deleted when nothing holds it."""

from __future__ import annotations

import time
import weakref
from collections import deque
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from . import gl
from .context import Gpu

if TYPE_CHECKING:
    from .pose import GpuPose


class GpuArray:
    """An array as texels.

    values: what it is made of, for as long as others may look for it. holders: the poses that have it.
    """

    values: NDArray | None

    def __init__(self, gpu: Gpu, values: NDArray, texel_format: int) -> None:
        self._gpu, self.values = gpu, values
        # OpenGL allows no buffer of no bytes; an empty array has one texel that nothing reads.
        data = values if values.size else np.zeros(4, np.float32)
        words = np.ascontiguousarray(data).reshape(-1).view(np.uint8)
        self.nbytes = len(words)
        size = gpu.staging.slice
        self._slices = deque((first, words[first : first + size]) for first in range(0, len(words), size))
        self.texels = gl.BufferTexture(gpu.buffer(reserve=self.nbytes), texel_format)
        self.holders: weakref.WeakSet[GpuPose] = weakref.WeakSet()

    def write(self, end: float = np.inf, slices: float = np.inf) -> bool:
        """Upload slices until that time of the performance counter, at least one and at most so many; whether
        all is there. Drivers that copy later return at once: then only the number bounds the work."""
        while self._slices:
            first, words = self._slices.popleft()
            self._gpu.staging.write(self.texels.buffer, words, first)
            slices -= 1
            if slices <= 0 or time.perf_counter() > end:
                break
        return not self._slices

    @property
    def uploaded_bytes(self) -> int:
        """Bytes that are on the GPU by now."""
        return self._slices[0][0] if self._slices else self.nbytes

    def __del__(self) -> None:
        if hasattr(self, "texels"):  # there may have been no memory for them
            self._gpu.discard(self.texels)


def shared_arrays(gpu: Gpu) -> weakref.WeakValueDictionary[tuple[str, int], GpuArray]:
    """The arrays that poses may have in common, by name and `id` of their values: what is equal in frames of
    a scan becomes one object when it is read (`PointCloud.sharing`)."""
    return gpu.cached(_no_arrays)


def _no_arrays(_: Gpu) -> weakref.WeakValueDictionary[tuple[str, int], GpuArray]:
    return weakref.WeakValueDictionary()


def as_float32(values: NDArray, zero: float = 0.0) -> NDArray[np.float32]:
    """Numbers relative to `zero` as the GPU holds them; those beyond its range are infinite there."""
    with np.errstate(over="ignore"):
        return (values - zero).astype(np.float32)
