"""Levels of captured images, whose samples are Gaussians in the picture (Farooq 2013, 6.2.3).

Each level of the Gaussian pyramids of range, mask and texture is scattered into a level of the picture whose
cells are as large as its samples are apart there, so that at any size the finest level is one of pixels, and
divided by its splat map. A view's bands are what each shows beyond the next coarser one. The thesis takes
that difference in the capture and scatters it; but scattering is linear, and differences of what was
scattered sum back to the finest level wherever samples lie, the capture's only where they lie on cells.

Sums are whole numbers with sign (`FixedPoint`): a weight is at most 1, the logarithm of light at most 4, and
no cell is given more than one number by each sample that is visited. Steps are such that so many fit into
31 bits: 2^-10 of 307,200 samples with their coarser levels, 2^-8 of 1.5 million; a quarter for weights.

Memory: 21.3 bytes a pixel for sums of one view after another, and 16 for the finest band.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from ...gpu import gl
from ...gpu.bindings import Texture
from ...gpu.context import Gpu, Program
from ...gpu.pyramid import sizes
from ...gpu.scatter import CellSums, FixedPoint, Visits
from ...picture.surface import Surface
from ...projection.views import ViewSource

_LIMIT = 4.0  # of light or of its logarithm
_FINEST = 2.0**-16


class CapturedLevels:
    """Sums of one view's samples in all levels of a picture, and the finest band of all views.

    starts: of the levels in the sums, cells.
    """

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._gpu = gpu
        counts = [width * height for width, height in sizes(size)]
        self.starts = [0, *np.cumsum(counts[:-1]).tolist()]
        self.sums = CellSums(gpu, sum(counts), 4)
        self.finest = gl.BufferTexture(gpu.buffer(reserve=16 * counts[0]), gl.RGBA32F)

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return self.sums.nbytes + self.finest.buffer.size

    def release(self) -> None:
        """Delete them."""
        self._gpu.discard(self.sums, self.finest)


def levels_that_fit(surface: Surface, view: int, detail: float) -> tuple[int, int]:
    """The level of a view whose samples are nearest to pixels apart where the subject is nearest, and in its
    middle; below 0 where pixels are finer. detail: pixels that samples may be apart."""
    pod, screen, bounds = surface.pose.views[view], surface.view, surface.pose.bounds
    middle = max(float(screen.depths(bounds.center - surface.pose.origin)), screen.near)
    away = float(np.linalg.norm(pod.world_to_camera[:3] @ [*bounds.center, 1.0]))
    found = []
    for nearer in (bounds.radius, 0.0):
        spacing = (1.0 if pod.kind == "height" else away + nearer) / min(pod.fx, pod.fy)
        depth = max(middle - nearer, screen.near) if screen.perspective else 1.0
        found.append(math.floor(math.log2(detail * depth / (spacing * screen.scale)) + 0.5))
    return found[0], found[1]


def add_splats(
    surface: Surface,
    source: ViewSource,
    view: int,
    levels: int,
    logarithmic: bool,
) -> FixedPoint:
    """Add up the samples of a view that the surface which pixels show does not hide, in that many levels of
    the picture; gives the steps of the sums."""
    samples, splats = source.samples, surface.cached(CapturedLevels)
    nearest, _ = levels_that_fit(surface, view, source.params.detail)
    farthest = samples.levels - levels
    used = samples.view_levels[view][max(min(nearest, farthest), 0) :]
    first = used[0].first
    count = used[-1].first + used[-1].count - first
    fixed = FixedPoint((1.0, _LIMIT, _LIMIT, _LIMIT), (_FINEST,) * 4, count)
    defines = {**source.defines(["color"]), "LOGARITHMIC": int(logarithmic)}
    bind = partial(_bind, surface, source, number=view, first=first, count=levels, farthest=farthest)
    splats.sums.clear()
    splats.sums.add(Visits("laplacian/splats.glsl", count, bind, defines, source.params), fixed)
    return fixed


def _bind(surface: Surface, source: ViewSource, program: Program, **uniforms: int) -> None:
    source.bind()
    surface.depths.bind(Texture.DEPTHS)
    surface.own("normal").bind(Texture.OWN_NORMALS)
    surface.gpu.set(program, **uniforms)
