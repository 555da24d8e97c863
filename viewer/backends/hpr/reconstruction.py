"""Reconstruction between the visible points in the picture, by pull and push (Marroquim 2008).

The choice of Machado e Silva 2014, 5.5. Pixels are reduced to levels of half, a quarter, ... of the picture's
size, in which only what lies in front counts, and points whose splats are as large as the level's cells. What
pixels lack is then filled from the finest level that has it.
"""

from __future__ import annotations

from itertools import pairwise

from ...gpu.bindings import Storage, Texture
from ...gpu.context import Gpu
from ...gpu.pose import GpuPose
from ...gpu.pyramid import FRONT_BOX, FRONT_TENT, Pyramid, fill, reduce
from ...picture.surface import Surface
from .splats import SectorSplats

_LEVELS = 8  # splats that reach 64 pixels are joined
_REACH = 0.25  # cells of a level that a splat must reach
_ENOUGH = 0.6  # of the cells around must be there to fill one between them


class PulledImages:
    """Images that are pulled and pushed. samples: depths, up to which others are of the same surface, radii
    and levels, by which the others go; looks: normals and values; and colours."""

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._gpu = gpu
        self.samples, self.looks = (Pyramid(gpu, size, 4, _LEVELS) for _ in range(2))
        self._colors: Pyramid | None = None

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU: 53 a pixel, 75 with colours."""
        return sum(each.nbytes for each in (self.samples, self.looks, self._colors) if each is not None)

    def colors(self) -> Pyramid:
        """Linear colours."""
        if self._colors is None:
            self._colors = Pyramid(self._gpu, self.samples.levels[0].size, 3, _LEVELS)
        return self._colors

    def release(self) -> None:
        """Delete everything."""
        for each in (self.samples, self.looks, self._colors):
            if each is not None:
                each.release()


def fill_between(pose: GpuPose, surface: Surface, splats: SectorSplats, radius_scale: float = 1.0) -> None:
    """Fill the pixels between the points that the surface shows, a pixel each. splats: of these.
    radius_scale: factor on their radii."""
    gpu, images = surface.gpu, surface.cached(PulledImages)
    count = surface.size[0] * surface.size[1]
    colors, values = pose.find("colors"), surface.row_values
    defines = {"HAS_COLORS": int(colors is not None), "HAS_VALUES": int(values is not None)}
    others = [images.looks] + ([images.colors()] if colors is not None else [])
    guide = images.samples.levels
    with gpu.timers.measure("pull"):
        program = gpu.compute("hpr/pull.comp", defines)
        surface.bind_textures()
        pose.array("positions").bind(Texture.POSITIONS)
        splats["splats"].bind(Texture.SPLATS)
        if colors is not None:
            colors.bind(Texture.COLORS)
            images.colors().levels[0].samples.buffer.bind_to_storage_buffer(Storage.COLOR_SAMPLES)
        if values is not None:
            values.bind(Texture.VALUES)
        guide[0].samples.buffer.bind_to_storage_buffer(Storage.SAMPLES)
        guide[0].weights.buffer.bind_to_storage_buffer(Storage.WEIGHTS)
        images.looks.levels[0].samples.buffer.bind_to_storage_buffer(Storage.LOOK_SAMPLES)
        gpu.dispatch(program, count)
    limit = gpu.compute("hpr/reach.comp")
    for level, (fine, coarse) in enumerate(pairwise(guide), 1):
        for other in others:
            reduce(gpu, other.levels[level - 1], other.levels[level], FRONT_BOX, fine)
        reduce(gpu, fine, coarse, FRONT_BOX)
        gpu.set(limit, level=level, reach=_REACH / radius_scale)
        coarse.samples.buffer.bind_to_storage_buffer(Storage.SAMPLES)
        coarse.weights.buffer.bind_to_storage_buffer(Storage.WEIGHTS)
        gpu.dispatch(limit, coarse.size[0] * coarse.size[1])
    for level, (fine, coarse) in reversed(list(enumerate(pairwise(guide)))):
        for other in others:
            fill(gpu, other.levels[level + 1], other.levels[level], FRONT_TENT, (coarse, fine), _ENOUGH)
        fill(gpu, coarse, fine, FRONT_TENT, enough=_ENOUGH)
    with gpu.timers.measure("push"):
        program = gpu.compute("hpr/push.comp", defines)
        surface.rows.bind(Texture.ROWS)
        guide[0].samples.bind(Texture.SAMPLES)
        guide[0].weights.bind(Texture.WEIGHTS)
        images.looks.levels[0].samples.bind(Texture.DETAIL)
        surface.bind_own("level", "normal")
        if colors is not None:
            images.colors().levels[0].samples.bind(Texture.COLORS)
            surface.bind_own("color")
        if values is not None:
            surface.bind_own("value")
        surface.depths.buffer.bind_to_storage_buffer(Storage.DEPTHS)
        gpu.dispatch(program, count)
