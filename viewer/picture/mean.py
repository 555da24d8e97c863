"""The mean of pictures: smooth edges, of several whose cameras are shifted by less than a pixel."""

from __future__ import annotations

import moderngl
import numpy as np

from ..gpu import gl
from ..gpu.bindings import Storage, Texture
from ..gpu.context import Gpu
from ..srgb import LIGHT_PARTS, LIGHT_STEPS, bytes_from_light, light_from_bytes


class PictureMean:
    """Sums of pictures of one size, (width, height) pixels: of light times alpha, and of alpha.

    Whole numbers, so that the mean is the same on every driver and in every order: each colour is the mean
    of linear light, weighted by alpha, to 1 / LIGHT_PARTS of a step (see `light_from_bytes`), each alpha the
    mean of alphas. Up to 256 pictures fit. count: of the pictures added.
    """

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._gpu = gpu
        self._pixels = size[0] * size[1]
        self.nbytes = 16 * self._pixels
        self._sums = gpu.buffer(reserve=self.nbytes)
        self.count = 0

    def clear(self) -> None:
        """Forget what was added."""
        self.count = 0

    def add(self, picture: moderngl.Buffer) -> None:
        """Add a picture, RGBA8 sRGB."""
        self._run(0, picture)
        self.count += 1

    def write(self, picture: moderngl.Buffer) -> None:
        """Write the mean over a picture; where all are transparent, that stays as it is."""
        self._run(1, picture)

    def _run(self, step: int, picture: moderngl.Buffer) -> None:
        program = self._gpu.compute("shade/mean.comp", {"STEP": step})
        with self._gpu.timers.measure("mean"):
            picture.bind_to_storage_buffer(Storage.PICTURE)
            self._sums.bind_to_storage_buffer(Storage.LIGHT_SUMS)
            self._gpu.cached(_light).bind(Texture.LIGHT)
            self._gpu.cached(_encoded).bind(Texture.ENCODED)
            self._gpu.set(program, pixels=self._pixels, count=self.count)
            self._gpu.dispatch(program, self._pixels)

    def release(self) -> None:
        """Delete the sums."""
        self._sums.release()


def _light(gpu: Gpu) -> gl.BufferTexture:
    return _words(gpu, light_from_bytes(np.arange(256, dtype=np.uint8)))


def _encoded(gpu: Gpu) -> gl.BufferTexture:
    return _words(gpu, bytes_from_light(np.arange(LIGHT_PARTS * LIGHT_STEPS + 1) / LIGHT_PARTS))


def _words(gpu: Gpu, values: np.ndarray) -> gl.BufferTexture:
    return gl.BufferTexture(gpu.buffer(values.astype(np.uint32)), gl.R32UI)
