"""The buffers of a picture on the GPU: depths, rows, colours, own channels, the list of covered pixels."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import TypeVar

import moderngl

from ..errors import InputError
from ..gpu import gl
from ..gpu.bindings import Storage, Texture, UniformBlock
from ..gpu.blocks import BlockBuffer
from ..gpu.compact import IndexList, list_covered
from ..gpu.constants import NO_DEPTH, NOTHING
from ..gpu.context import Fill, Gpu, Resource, Workspace
from ..gpu.scatter import OnePass, TwoPasses, Visits, keeping_nearest
from ..gpu.view import ViewBlock
from ..look import Look, rgba

# What a backend may write for each pixel: the format of a texel, and its bytes.
_CHANNELS = {"color": (gl.RGBA8, 4), "normal": (gl.RGB32F, 12), "value": (gl.R32F, 4), "level": (gl.R32UI, 4)}

W = TypeVar("W", bound=Workspace)


class PictureBuffers:
    """The pixels of a picture on the GPU, one word each. Row 0 is the top.

    depths: float bits, from the view's base, +inf: nothing. rows: the row that a pixel shows, 0xFFFFFFFF:
    none. picture: RGBA8 sRGB. A pixel is covered where its depth is finite; covered: the list of these, as
    far as it is known. Backends may store what they work with (`cached`), and channels of their own.
    """

    look: Look  # that the picture is drawn for, and was shaded in last

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self.gpu = gpu
        self._resources: tuple[Resource, ...] = ()
        self._own: dict[str, gl.BufferTexture] = {}
        self._cached: dict[Callable[..., Workspace], Workspace] = {}
        self._raster: gl.Raster | None = None
        width, height = size
        if width < 1 or height < 1:
            raise InputError(f"a picture cannot have {width}x{height} pixels")
        if width * height > gpu.max_pixels:
            raise InputError(
                f"a picture of {width}x{height} pixels is too large: this graphics driver "
                f"can draw at most {gpu.max_pixels:,} pixels",
                hint="Use a smaller --size",
            )
        gpu.collect()
        self.size = (width, height)
        self.depths = gl.BufferTexture(gpu.buffer(reserve=4 * width * height), gl.R32UI)
        self.rows = gl.BufferTexture(gpu.buffer(reserve=4 * width * height), gl.R32UI)
        self.picture = gpu.buffer(reserve=4 * width * height)
        self._block = BlockBuffer(gpu.ctx, ViewBlock, UniformBlock.VIEW)
        self.covered = IndexList(gpu, width * height)
        self._covered_known = self._slots_known = False
        self._clear_as: str | None = None  # the background of all pixels that `covered` does not list
        self._left_as: str | None = None  # the same of the picture before
        self._filled_as: str | None = None  # what fills the picture until it is shaded
        self._resources = (self.depths, self.rows, self.picture, self._block, self.covered)

    def bind_view(self) -> None:
        """Make this surface's view the one that shaders read."""
        self._block.bind()

    def bind_textures(self) -> None:
        """Bind depths and rows for shaders to fetch."""
        self.depths.bind(Texture.DEPTHS)
        self.rows.bind(Texture.ROWS)

    def bind_storage(self) -> None:
        """Bind depths and rows for compute shaders to change."""
        self.depths.buffer.bind_to_storage_buffer(Storage.DEPTHS)
        self.rows.buffer.bind_to_storage_buffer(Storage.ROWS)

    def start_listed(self, background: str) -> IndexList:
        """Clear the picture, depths and rows, for a backend that lists the pixels that it covers at less than
        the cost of looking at every pixel; that list, whose slots may be no pixel, 0xFFFFFFFF, or the same.

        Where the picture before was listed as well, its pixels alone are cleared.
        """
        if self._left_as == background:
            with self.gpu.timers.measure("clear"):
                self.bind_storage()
                self.picture.bind_to_storage_buffer(Storage.CLEARED_PICTURE)
                program = self.gpu.compute("shade/clear.comp")
                self.gpu.set(program, background=picture_word(background))
                self.covered.run(program)
        else:
            self.gpu.fill(*self._empty(), Fill(self.picture, picture_word(background)))
        self._clear_as, self._slots_known = background, True
        return self.covered

    def take_picture(self) -> moderngl.Buffer:
        """The picture, to write to pixels that are not covered too."""
        self._clear_as = None
        return self.picture

    def clear_picture(self, background: str) -> None:
        """Make the picture this colour, at least where nothing is shown."""
        if self._clear_as != background:
            if self._filled_as != background:
                self.gpu.clear(self.picture, picture_word(background))
            self._clear_as = background if self._slots_known else None
        self._filled_as = None

    def list_shown(self) -> IndexList:
        """The list of the pixels that show something, in no order, which may have slots that are no pixel,
        0xFFFFFFFF: what shading works on."""
        return self.covered if self._slots_known else self.list_covered()

    def list_covered(self) -> IndexList:
        """The list of the pixels that show something, in no order."""
        if not self._covered_known:
            self.depths.bind(Texture.DEPTHS)
            list_covered(self.gpu, self.size[0] * self.size[1], self.covered)
            self._covered_known = True
        return self.covered

    def clear(self) -> None:
        """Nothing anywhere."""
        self.gpu.fill(*self._empty(), *self._fill_picture())

    @contextmanager
    def keeping_nearest(self, shown: Callable[[], Visits] | None = None) -> Iterator[TwoPasses | OnePass]:
        """Keep the nearest of all visits to pixels that are taken inside, see `keeping_nearest`."""
        with keeping_nearest(self.gpu, self.depths, self.rows, shown, self._fill_picture) as nearest:
            yield nearest

    def _empty(self) -> tuple[Fill, Fill]:
        """Depths and rows of nothing."""
        return Fill(self.depths.buffer, NO_DEPTH), Fill(self.rows.buffer, NOTHING)

    def _fill_picture(self) -> Sequence[Fill]:
        """The fill of the picture before shading, to go with other fills; empty if it is filled."""
        background = self.look.background
        if self._filled_as == background:
            return ()
        self._filled_as = background
        return (Fill(self.picture, picture_word(background)),)

    def raster(self) -> gl.Raster:
        """The framebuffer of backends that rasterise; `take_raster` makes it the Surface.

        Raises InputError for a picture that is too long for one.
        """
        if self._raster is None:
            width, height = self.size
            if max(self.size) > gl.max_raster_edge():
                raise InputError(
                    f"a picture of {width}x{height} pixels is too large: this graphics driver "
                    f"can draw at most {gl.max_raster_edge():,} pixels along an edge",
                    hint="Use a smaller --size, or --backend points",
                )
            raster = gl.Raster(self.gpu.ctx, self.size)
            self.gpu.check_memory(raster)
            self._raster = raster
        return self._raster

    def take_raster(self) -> None:
        """Copy what was rasterised into the Surface."""
        self.raster().copy_to(self.rows.buffer, self.depths.buffer)

    def cached(self, make: Callable[[Gpu, tuple[int, int]], W]) -> W:
        """Make, once, of the context and the size, what a backend works with from picture to picture. Counted
        and deleted with the surface."""
        if make not in self._cached:
            self._cached[make] = make(self.gpu, self.size)
        return self._cached[make]  # type: ignore[return-value]

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        words = 3 + (3 if self._raster else 0) + sum(_CHANNELS[name][1] for name in self._own) // 4
        kept = sum(workspace.nbytes for workspace in self._cached.values())
        return 4 * self.size[0] * self.size[1] * words + self.covered.nbytes + kept

    def release(self) -> None:
        """Give up what it holds on the GPU now; otherwise that goes with the object."""
        nbytes = self.nbytes if self._resources else 0
        everything = (*self._resources, *self._own.values(), *self._cached.values(), self._raster)
        self.gpu.discard(*everything, nbytes=nbytes)
        self._resources, self._own, self._cached, self._raster = (), {}, {}, None

    def __del__(self) -> None:
        self.release()

    def _texels(self, name: str) -> gl.BufferTexture:
        """A channel of a texel for each pixel."""
        texel_format, size = _CHANNELS[name]
        buffer = self.gpu.buffer(reserve=size * self.size[0] * self.size[1])
        return gl.BufferTexture(buffer, texel_format)


@cache
def picture_word(color: str) -> int:
    """A colour of a look as a pixel of a picture."""
    return int.from_bytes(bytes(rgba(color)), "little")
