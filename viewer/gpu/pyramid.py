"""Pyramid: images, each half the size of the one before, and the steps up and down between them.

Burt and Adelson 1983, with weights: only samples that are there count, and what lies outside an image is not
there either, so that one rule serves holes, masks and borders: sums of taps times weights times values are
divided by the sums of taps times weights. A level's weights are those means of the finer level's inside the
image: how much of a sample's surroundings is there.

Costs: a step reads each finer sample about once (`BOX`) to six times (`BINOMIAL`) and keeps 4 bytes a channel
and 4 for the weight; a whole chain has 4/3 of the samples of its first image.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from . import gl
from .bindings import Storage, Texture
from .context import Gpu

_FORMATS = {1: gl.R32F, 2: gl.RG32F, 3: gl.RGB32F, 4: gl.RGBA32F}


@dataclass(frozen=True)
class Filter:
    """Relation of one sample of a level to those of the next finer one, along either axis.

    Coarse sample i is the mean of the fine samples 2 i + first and those that follow, weighted by taps. Fine
    sample j is the mean of the coarse samples that it is part of, weighted by the same taps. With an even
    number of taps a coarse pixel covers two fine ones: a position x, pixel centres at +0.5, is 2 x in the
    finer image. With an odd number a coarse pixel lies at every other fine one: there it is 2 x - 0.5.

    nearest: a coarse sample is not the mean, but that one of the fine samples in reach whose first channel is
    least, whatever the taps, so that depths on either side of an outline are not mixed.

    front: the mean is of the nearest surface alone. The first channel is a depth, the second the depth up to
    which others are of one surface with that sample: those behind that of the nearest in reach do not count.
    """

    first: int
    taps: tuple[float, ...]
    nearest: bool = False
    front: bool = False


BOX = Filter(0, (1.0, 1.0))  # means of 2 x 2, as mipmaps have them; expanded: each sample four times
NEAREST = Filter(0, (1.0, 1.0), nearest=True)  # the nearest of 2 x 2
TENT = Filter(-1, (1.0, 3.0, 3.0, 1.0))  # expanded: bilinear
BINOMIAL = Filter(-2, (1.0, 4.0, 6.0, 4.0, 1.0))  # Burt and Adelson's, a = 0.375
FRONT_BOX = Filter(0, (1.0, 1.0), front=True)  # the two steps of pull and push (Marroquim 2008)
FRONT_TENT = Filter(-1, (1.0, 3.0, 3.0, 1.0), front=True)
GAUSSIAN = Filter(-1, (math.exp(-2), 1.0, math.exp(-2)))  # 3 x 3, of spread 0.5 (Farooq 2013, 3.3.2)


class Image:
    """Samples in rows from the top on the GPU: 1 to 4 channels of float32, and a weight each.

    A sample whose weight is not above 0 and finite is not there, and its values, NaN and infinite ones too,
    are not used; a step writes zeros for it. Raises InputError where the driver takes no so large image,
    ValueError for sizes and channels that are none.
    """

    def __init__(self, gpu: Gpu, size: tuple[int, int], channels: int) -> None:
        width, height = size
        if width < 1 or height < 1 or channels not in _FORMATS:
            raise ValueError(f"an image cannot have {width}x{height} samples of {channels} channels")
        nbytes = 4 * channels * width * height
        if nbytes > gpu.max_storage_bytes or width * height > gpu.max_points:
            raise InputError(f"an image of {width}x{height} samples is too large for this graphics driver")
        self._gpu = gpu
        self.size = size
        self.channels = channels
        self.samples = gl.BufferTexture(gpu.buffer(reserve=nbytes), _FORMATS[channels])
        self.weights = gl.BufferTexture(gpu.buffer(reserve=4 * width * height), gl.R32F)

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return self.samples.buffer.size + self.weights.buffer.size

    def write(self, samples: NDArray[np.float32], weights: NDArray[np.float32] | None = None) -> None:
        """Set all samples, (H, W, channels), and weights, (H, W); None: 1 each."""
        width, height = self.size
        filled = np.ones((height, width), np.float32) if weights is None else weights
        self.samples.buffer.write(
            np.ascontiguousarray(samples.reshape(height, width, self.channels), np.float32)
        )
        self.weights.buffer.write(np.ascontiguousarray(filled.reshape(height, width), np.float32))

    def read(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """All samples, (H, W, channels), and weights, (H, W); waits for the GPU."""
        width, height = self.size
        samples = self._gpu.read(self.samples.buffer, np.float32)
        weights = self._gpu.read(self.weights.buffer, np.float32)
        return samples.reshape(height, width, self.channels), weights.reshape(height, width)

    def release(self) -> None:
        """Delete it."""
        self._gpu.discard(self.samples, self.weights)


class Pyramid:
    """Images with the same channels, the first of any size, each other half as wide and high as the one
    before, rounded up: as many as are asked for, or down to a single sample."""

    def __init__(self, gpu: Gpu, size: tuple[int, int], channels: int, levels: int | None = None) -> None:
        self._gpu = gpu
        self.levels = [Image(gpu, each, channels) for each in sizes(size, levels)]

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return sum(level.nbytes for level in self.levels)

    def reduce(self, how: Filter) -> None:
        """Make each level of the one before."""
        for fine, coarse in pairwise(self.levels):
            reduce(self._gpu, fine, coarse, how)

    def release(self) -> None:
        """Delete all levels."""
        self._gpu.discard(*self.levels)


def sizes(size: tuple[int, int], levels: int | None = None) -> list[tuple[int, int]]:
    """The sizes of a pyramid's levels, (width, height)."""
    most = max(size[0] - 1, size[1] - 1).bit_length() + 1
    return [(-(-size[0] // 2**k), -(-size[1] // 2**k)) for k in range(most if levels is None else levels)]


def reduce(gpu: Gpu, fine: Image, coarse: Image, how: Filter, guide: Image | None = None) -> None:
    """Make a level of the next finer one. guide: an image of the fine one's size, whose weights count and
    which, with `Filter.front`, tells which samples are in front; None: the fine one itself."""
    _Step("reduce", fine, coarse, how, {"NEAREST": int(how.nearest)}, guide=guide).run(gpu)


def expand(gpu: Gpu, coarse: Image, fine: Image, how: Filter) -> None:
    """Make a level of the next coarser one."""
    _Step("expand", coarse, fine, how, {}).run(gpu)


def fill(
    gpu: Gpu,
    coarse: Image,
    fine: Image,
    how: Filter,
    guides: tuple[Image, Image] | None = None,
    enough: float = 0.0,
) -> None:
    """Give the samples of a level that are not there what the next coarser level, expanded, has in their
    pixels, where its weight is enough. guides: images of the sizes of both, coarse and fine, in the place of
    which they count, as in `reduce`; None: these themselves."""
    its_guide, known = guides or (coarse, fine)
    _Step("expand", coarse, fine, how, {"FILLS": 1}, its_guide, known, enough).run(gpu)


@dataclass(frozen=True)
class _Step:
    """A run of shaders/pyramid/NAME.comp for each sample of the result.

    guide: the image whose weights count in place of the source's; known: in place of the result's. enough:
    the weight from which on samples fill those of the result that are not there.
    """

    name: str
    source: Image
    result: Image
    how: Filter
    defines: Mapping[str, int]
    guide: Image | None = None
    known: Image | None = None
    enough: float = 0.0

    def run(self, gpu: Gpu) -> None:
        source, result, how = self.source, self.result, self.how
        guide = self.guide or source
        _check(self.name, source, result)
        _check(self.name, guide, self.known or result, channels=False)
        taps = ", ".join(str(np.float32(tap)) for tap in how.taps)
        taken = {"CHANNELS": f"{result.channels}u", "FIRST": how.first, "COUNT": len(how.taps)}
        given = {"FRONT": int(how.front), "FILLS": 0, **self.defines, **taken, "TAPS": f"float[]({taps})"}
        program = gpu.compute(f"pyramid/{self.name}.comp", given)
        source.samples.bind(Texture.SAMPLES)
        guide.weights.bind(Texture.WEIGHTS)
        if how.front:
            guide.samples.bind(Texture.GUIDE)
        if self.known is not None:
            self.known.weights.bind(Texture.KNOWN_WEIGHTS)
            gpu.set(program, enough=self.enough)
        result.samples.buffer.bind_to_storage_buffer(Storage.SAMPLES)
        result.weights.buffer.bind_to_storage_buffer(Storage.WEIGHTS)
        gpu.set(program, size=source.size, out_size=result.size)
        with gpu.timers.measure(self.name):
            gpu.dispatch(program, result.size[0] * result.size[1])


def _check(name: str, source: Image, result: Image, channels: bool = True) -> None:
    """Raise ValueError where images do not belong together. channels: whether theirs must be as many."""
    fine, coarse = (source, result) if name == "reduce" else (result, source)
    if coarse.size != sizes(fine.size, 2)[1]:
        raise ValueError(f"the levels do not follow one another: {[source.size, result.size]}")
    if channels and source.channels != result.channels:
        raise ValueError("the levels have different channels")
    if result is source:
        raise ValueError("a level cannot replace the level that it is computed from")
