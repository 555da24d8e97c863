"""The multi-resolution spline of what several views see of one surface (Burt and Adelson 1983).

What is splined are the differences of each view's picture to one in which each pixel is the best view's: that
comes out the same, since bands are sums, and where views agree nothing is changed, also along outlines
and masks where some of them see nothing.

Memory: 8 bytes a pixel for each view; 32 a pixel, and 13.4 for levels, for all of them together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from moderngl import ComputeShader

from ...errors import InputError
from ...gpu import gl
from ...gpu.bindings import Storage, Texture, texture
from ...gpu.context import Gpu, Program
from ...gpu.pyramid import BINOMIAL, GAUSSIAN, Filter, sizes
from ...gpu.scatter import FixedPoint
from ...picture.surface import Surface
from ...projection.sources import CHANNELS
from ...projection.views import DrawnTiles, ViewSource
from .splats import CapturedLevels, add_splats, levels_that_fit

_MOST = 6  # levels
FILTERS = {"5x5": BINOMIAL, "3x3": GAUSSIAN}


class Pictures:
    """Pictures of what each view sees of the surface that is drawn, and what is merged of them."""

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._gpu = gpu
        self._pixels = size[0] * size[1]
        self.sizes = sizes(size, _MOST)
        counts = [width * height for width, height in self.sizes]
        self.starts = [0, *np.cumsum([0, *counts[1:-1]]).tolist()]  # of levels from 1 on
        cells = sum(counts[1:])
        self.views: list[gl.BufferTexture] = []
        self.merged = _texels(gpu, gl.RGBA32F, 16 * self._pixels)
        self.winners = _texels(gpu, gl.RGBA32UI, 16 * self._pixels)
        self.bands = _texels(gpu, gl.RGBA32F, 16 * cells)
        self.shares = _texels(gpu, gl.RG32F, 8 * cells)
        self.merged_bands = _texels(gpu, gl.RGBA32F, 16 * cells)

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return sum(each.buffer.size for each in self._all())

    def reserve(self, views: int) -> None:
        """Make room for the pictures of so many views."""
        while len(self.views) < views:
            self.views.append(_texels(self._gpu, gl.RG32UI, 8 * self._pixels))

    def release(self) -> None:
        """Delete them."""
        self._gpu.discard(*self._all())

    def _all(self) -> list[gl.BufferTexture]:
        return [*self.views, self.merged, self.winners, self.bands, self.shares, self.merged_bands]


@dataclass(frozen=True)
class Bands:
    """How views are merged.

    levels: bands. filter: of their pyramids. detail: gain of the finest. crisp: whether the view that sees a
    position best alone has all bands but the coarsest, top_crisp: whether it has that, too; else all views
    have their parts. logarithmic: whether bands are of the logarithm of light. captured: whether bands are of
    the captured images rather than of pictures. fine: whether pixels look at four samples of a level
    that is finer than they are, else between two levels.
    """

    levels: int
    filter: Filter
    detail: float
    crisp: bool
    top_crisp: bool
    logarithmic: bool
    captured: bool
    fine: bool


def spline_views(surface: Surface, source: ViewSource, channels: Sequence[str], bands: Bands) -> None:
    """Have pixels show what all views see of the surface that they show now.

    channels: what they have. Raises InputError for a picture that is too large for the driver.
    """
    views = surface.cached(DrawnTiles).read_views()
    colored = "color" in channels
    merges = colored and len(views) > (0 if bands.captured else 1)
    sharpens = colored and bands.detail != 1 and not bands.captured
    if not colored:
        surface.stats.skipped["bands"] = "views have no colours"
    elif not merges:
        surface.stats.skipped["bands"] = "the picture shows only one range view"
    if len(views) < 2 and not (merges or sharpens or (colored and bands.fine)):
        return
    size = surface.size
    if 16 * size[0] * size[1] > surface.gpu.max_storage_bytes:
        raise InputError(
            f"this graphics driver cannot merge views in a picture of {size[0]}x{size[1]} pixels",
            hint="Use a smaller --size, or --backend pyramidal",
        )
    spline = _Spline(surface, source, channels, bands)
    spline.look(views)
    if merges:
        spline.merge_bands(views)
    if sharpens:
        spline.smooth()
    spline.finish(merges, sharpens)


class _Spline:
    """The steps of one picture."""

    def __init__(self, surface: Surface, source: ViewSource, channels: Sequence[str], bands: Bands) -> None:
        self._gpu, self._surface, self._source, self._channels = surface.gpu, surface, source, channels
        self._covered = surface.list_covered()
        self._pictures = surface.cached(Pictures)
        self._bands = bands
        self._levels = range(1, min(bands.levels, len(self._pictures.sizes)))
        self._light = {"LOGARITHMIC": int(bands.logarithmic)}
        self._crisp = {"CRISP": int(bands.crisp), **self._light}
        self._top_crisp = {"TOP_CRISP": int(bands.top_crisp)}
        taps = ", ".join(str(np.float32(tap)) for tap in bands.filter.taps)
        self._taps = {
            "FIRST": bands.filter.first,
            "COUNT": len(bands.filter.taps),
            "TAPS": f"float[]({taps})",
            **self._light,
        }

    def look(self, views: Sequence[int]) -> None:
        """Make the pictures of views, the picture of the best of them, and the differences to it."""
        surface, pictures = self._surface, self._pictures
        pictures.reserve(len(views))
        defines = {
            **self._source.defines(self._channels),
            "BLEND": 1,
            "FINE": int(self._bands.fine),
            **self._crisp,
        }
        look = self._gpu.compute("laplacian/look.comp", defines, params=self._source.params)
        for turn, view in enumerate(views):
            with self._gpu.timers.measure(f"view {view}"):
                self._gpu.clear(pictures.views[turn].buffer, 0)
                self._source.bind()
                surface.bind_textures()
                for name in self._channels:
                    surface.own(name).bind(texture(f"own_{name}s"))
                pictures.views[turn].buffer.bind_to_storage_buffer(Storage.VIEW_PICTURE)
                pictures.merged.buffer.bind_to_storage_buffer(Storage.MERGED)
                pictures.winners.buffer.bind_to_storage_buffer(Storage.WINNERS)
                self._gpu.set(look, number=view, first=turn == 0)
                self._run(look)

    def merge_bands(self, views: Sequence[int]) -> None:
        """Sum the bands of all views, or of their differences."""
        pictures, gpu = self._pictures, self._gpu
        with gpu.timers.measure("differences"):
            for picture in pictures.views[: len(views)]:
                self._differ(picture, whole=False)
        self._gpu.clear(pictures.merged_bands.buffer, 0)
        if self._bands.captured:
            self._add_captured(views)
        else:
            self._add_differences(views)
        for level in reversed(self._levels):
            top = level == self._levels[-1]
            with gpu.timers.measure(f"sum level {level}"):
                defines = {**self._taps, "TOP": int(top), "CAPTURED": int(self._bands.captured)}
                program = gpu.compute("laplacian/collapse.comp", defines)
                pictures.merged_bands.bind(Texture.DETAIL)
                pictures.merged_bands.buffer.bind_to_storage_buffer(Storage.MERGED_BANDS)
                self._dispatch(program, level if top else level + 1, level)

    def _add_differences(self, views: Sequence[int]) -> None:
        """Add up the bands of the differences of pictures."""
        pictures, gpu = self._pictures, self._gpu
        finest = gpu.compute("laplacian/finest.comp", self._taps)
        for picture, view in zip(pictures.views, views, strict=False):
            for level in self._levels:
                with gpu.timers.measure(f"view {view} level {level}"):
                    self._reduce(picture, level)
            for level in self._levels:
                with gpu.timers.measure(f"view {view} level {level}"):
                    self._add_band(level)
            with gpu.timers.measure(f"view {view} level 0"):
                picture.bind(Texture.LOOKS)
                pictures.bands.bind(Texture.SAMPLES)
                pictures.merged.buffer.bind_to_storage_buffer(Storage.MERGED)
                self._set_levels(finest, 1, 0)
                self._run(finest)

    def _add_captured(self, views: Sequence[int]) -> None:
        """Add up the bands of captured images: of as many levels as all views have from the one that fits."""
        pictures, gpu, splats = self._pictures, self._gpu, self._surface.cached(CapturedLevels)
        self._gpu.clear(splats.finest.buffer, 0)
        source, bands = self._source, self._bands
        fits = max(levels_that_fit(self._surface, view, source.params.detail)[1] for view in views)
        count = min(len(self._levels) + 1, max(source.samples.levels - max(fits, 0), 1))
        self._levels = range(1, count)
        for picture, view in zip(pictures.views, views, strict=False):
            for level in self._levels:
                with gpu.timers.measure(f"view {view} level {level}"):
                    self._reduce(picture, level)
            with gpu.timers.measure(f"view {view} splats"):
                fixed = add_splats(self._surface, source, view, count, bands.logarithmic)
                self._divide(fixed)
            for level in range(count):
                with gpu.timers.measure(f"view {view} level {level}"):
                    self._combine(picture, level, fixed)

    def _divide(self, fixed: FixedPoint) -> None:
        """Make the coarser levels of what the samples of a view show."""
        pictures, splats = self._pictures, self._surface.cached(CapturedLevels)
        program = self._gpu.compute("laplacian/divide.comp", fixed.defines)
        splats.sums.buffer.bind_to_storage_buffer(Storage.SUMS)
        pictures.bands.buffer.bind_to_storage_buffer(Storage.BANDS)
        self._gpu.set(program, start=splats.starts[1])
        self._gpu.dispatch(program, sum(width * height for width, height in pictures.sizes[1:]))

    def _combine(self, picture: gl.BufferTexture, level: int, fixed: FixedPoint) -> None:
        """Add a view's band of a level."""
        pictures, splats, top = (
            self._pictures,
            self._surface.cached(CapturedLevels),
            level == len(self._levels),
        )
        ends = {"FINEST": int(level == 0), "TOP": int(top)}
        program = self._gpu.compute("laplacian/combine.comp", {**self._taps, **fixed.defines, **ends})
        picture.bind(Texture.LOOKS)
        self._bind_bands()
        splats.sums.buffer.bind_to_storage_buffer(Storage.SUMS)
        merged = pictures.merged_bands if level else splats.finest
        merged.buffer.bind_to_storage_buffer(Storage.MERGED_BANDS)
        self._gpu.set(program, sums_start=splats.starts[level])
        self._dispatch(program, level if top else level + 1, level)

    def smooth(self) -> None:
        """Make level 1 of the merged picture itself, whose finest band is what it has beyond that."""
        picture = self._pictures.views[0]
        with self._gpu.timers.measure("smooth"):
            self._differ(picture, whole=True)
            self._reduce(picture, 1)

    def finish(self, merged: bool, sharpened: bool) -> None:
        """Show it. merged: whether there are bands. sharpened: whether it was made smooth."""
        surface, pictures, gpu = self._surface, self._pictures, self._gpu
        captured = merged and self._bands.captured
        coarser = merged and bool(self._levels)
        defines: dict[str, object] = {name.upper(): int(name in self._channels) for name in CHANNELS}
        defines |= {"SPLINE": int(coarser), "SHARPEN": int(sharpened), "CAPTURED": int(captured)}
        program = gpu.compute("laplacian/finish.comp", {**self._taps, **defines})
        if sharpened or captured:
            gpu.set(program, gain=self._bands.detail if sharpened or coarser else 1.0)
        with gpu.timers.measure("sum level 0"):
            self._source.bind()
            surface.bind_storage()
            surface.bind_own("level", *self._channels)
            pictures.merged.bind(Texture.COLORS)
            pictures.winners.bind(Texture.BEST)
            (surface.cached(CapturedLevels).finest if captured else pictures.bands).bind(Texture.SAMPLES)
            pictures.merged_bands.bind(Texture.DETAIL)
            self._set_levels(program, 1, 0)
            self._run(program)

    def _differ(self, picture: gl.BufferTexture, whole: bool) -> None:
        """Make of a view's picture its difference to the merged one, or that as a whole."""
        program = self._gpu.compute(
            "laplacian/differ.comp", {**self._crisp, **self._top_crisp, "WHOLE": int(whole)}
        )
        self._pictures.merged.bind(Texture.COLORS)
        self._pictures.winners.bind(Texture.BEST)
        picture.buffer.bind_to_storage_buffer(Storage.VIEW_PICTURE)
        self._run(program)

    def _reduce(self, picture: gl.BufferTexture, level: int) -> None:
        """Make a level of a view's differences."""
        pictures, lowest = self._pictures, level == 1
        program = self._gpu.compute("laplacian/reduce.comp", {**self._taps, "LOWEST": int(lowest)})
        if lowest:
            picture.bind(Texture.LOOKS)
        else:
            self._bind_bands()
        pictures.bands.buffer.bind_to_storage_buffer(Storage.BANDS)
        pictures.shares.buffer.bind_to_storage_buffer(Storage.BAND_SHARES)
        self._dispatch(program, level - 1, level)

    def _add_band(self, level: int) -> None:
        """Add the band of a level of the view whose levels there are."""
        top = level == self._levels[-1]
        program = self._gpu.compute("laplacian/band.comp", {**self._taps, "TOP": int(top)})
        self._bind_bands()
        self._pictures.merged_bands.buffer.bind_to_storage_buffer(Storage.MERGED_BANDS)
        self._dispatch(program, level if top else level + 1, level)

    def _bind_bands(self) -> None:
        self._pictures.bands.bind(Texture.SAMPLES)
        self._pictures.shares.bind(Texture.WEIGHTS)

    def _set_levels(self, program: Program, read: int, written: int) -> None:
        """Set the levels that a program reads and writes."""
        sizes, starts = self._pictures.sizes, self._pictures.starts
        self._gpu.set(program, size=sizes[read], start=starts[read])
        self._gpu.set(program, out_size=sizes[written], out_start=starts[written])

    def _dispatch(self, program: ComputeShader, read: int, written: int) -> None:
        """Make a level."""
        self._set_levels(program, read, written)
        width, height = self._pictures.sizes[written]
        self._gpu.dispatch(program, width * height)

    def _run(self, program: ComputeShader) -> None:
        """Run a program over what is covered."""
        self._covered.texels.bind(Texture.LISTED)
        self._covered.run(program)


def _texels(gpu: Gpu, texel_format: int, nbytes: int) -> gl.BufferTexture:
    return gl.BufferTexture(gpu.buffer(reserve=max(nbytes, 16)), texel_format)
