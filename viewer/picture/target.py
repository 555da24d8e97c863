"""What backends write: depths and rows of each pixel, and what they have of their own."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import TypeVar

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..geometry import up_vector
from ..gpu import gl
from ..gpu.bindings import Storage, Texture, UniformBlock
from ..gpu.blocks import BlockBuffer
from ..gpu.chunks import Chunks
from ..gpu.compact import IndexList, list_covered
from ..gpu.constants import NO_DEPTH, NOTHING
from ..gpu.context import Gpu, Resource, Workspace
from ..gpu.pose import GpuPose
from ..gpu.view import ViewBlock
from ..look import Look, ValueKind, is_lit, rgba, value_source, wants_normals
from ..scan.layers import NO_LAYERS, Layers
from ..scan.points import PointCloud
from ..scan.range_points import RangePoints
from ..scan.ranges import robust_range
from ..view import View
from .sample import is_sampled, row_list, sample_of
from .stats import Stats

_SAMPLED = 256  # pixels along the longer edge whose numbers tell a range
_FEW = 1000  # points of which none is left out: it would gain nothing, and they would be missed
# What a backend may write for each pixel: the format of a texel, and its bytes.
_CHANNELS = {"color": (gl.RGBA8, 4), "normal": (gl.RGB32F, 12), "value": (gl.R32F, 4), "level": (gl.R32UI, 4)}
_RESOLVED = {"color": 0, "normal": 1, "value": 2}  # as shade/resolve.comp numbers them

W = TypeVar("W", bound=Workspace)


class RenderTarget:
    """A picture's pixels as they are drawn, before shading. Row 0 is the top.

    On the GPU: `depths` (float bits, from the view's base, +inf: nothing) and `rows` (the point that a pixel
    shows, 0xFFFFFFFF: none), one word a pixel. A pixel is covered where its depth is finite. Colour,
    normal and value are those of the row, unless the backend wrote its `own`; a pixel without a row is
    filled, and what the backend did not write of it is unknown.
    drawn: what the picture was made of, by name; empty before, and where drawing failed. is_whole: whether
    that is drawn in full, so that drawing it again would change nothing.
    look: what it is drawn for, and shaded in last. layers: over the pose. needs: names of what the backend
    has of the pose, stored or estimated. finds: the numbers that the backend finds for rows, by name, unless
    the scan or a layer has one of that name.
    is_lit: whether the backend's own colours are as the look asks for, light included.
    color_range: where the colour map began and ended when it was shaded, None where none was used.
    samples: the points of range views whose samples the rows are; None where these are points.
    """

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self.gpu = gpu
        self._resources: tuple[Resource, ...] = ()
        self._own: dict[str, gl.BufferTexture] = {}
        self._kept: dict[Callable[..., Workspace], Workspace] = {}
        self._raster: gl.Raster | None = None
        width, height = size
        if width < 1 or height < 1:
            raise InputError(f"a picture of {width}x{height} pixels cannot be drawn")
        if width * height > gpu.max_pixels:
            raise InputError(
                f"a picture of {width}x{height} pixels is too large; this driver takes "
                f"{gpu.max_pixels:,} pixels",
                hint="Use a smaller --size",
            )
        gpu.collect()
        self.size = (width, height)
        self.depths = gl.BufferTexture(gpu.buffer(reserve=4 * width * height), gl.R32UI)
        self.rows = gl.BufferTexture(gpu.buffer(reserve=4 * width * height), gl.R32UI)
        self.picture = gpu.buffer(reserve=4 * width * height)
        self._block = BlockBuffer(gpu.ctx, ViewBlock, UniformBlock.VIEW)
        self._shown: tuple[GpuPose, View] | None = None
        self._stood_for: tuple[GpuPose, NDArray[np.uint32]] | None = None
        self._octants: NDArray[np.uint32] | None = None
        self.samples: RangePoints | None = None
        self.look = Look()
        self.layers = NO_LAYERS
        self.needs: Collection[str] = ()
        self.finds: Mapping[str, ValueKind] = {}
        self._given: tuple[str, gl.BufferTexture] | None = None  # which of these the backend gave
        self.color_range: tuple[float, float] | None = None
        self.stats = Stats()
        self.covered = IndexList(gpu, width * height)
        self._covered_known = self._slots_known = False
        self._clear_as: str | None = None  # the background of all pixels that `covered` does not list
        self._left_as: str | None = None  # the same of the picture before
        self._written: set[str] = set()
        self.is_lit = False
        self.drawn: dict[str, object] = {}
        self.is_whole = False
        self._blended: tuple[str | None, str] | None = None  # the source that its own values are of, and up
        self._resources = (self.depths, self.rows, self.picture, self._block, self.covered)

    def start(
        self,
        pose: GpuPose,
        view: View,
        look: Look | None = None,
        layers: Layers = NO_LAYERS,
        finds: Mapping[str, ValueKind] | None = None,
        needs: Collection[str] = (),
    ) -> None:
        """Begin a frame: what backends and shading read from now on."""
        self.needs = needs
        self._shown, self._stood_for, self.samples = (pose, view), None, None
        self._octants = None
        self.look, self.layers = look or Look(), layers
        scalars = layers.names(pose.overview.scalars)
        self.finds = {name: kind for name, kind in (finds or {}).items() if name not in scalars}
        self._given = None
        self._block.write(ViewBlock.of(view))
        self.bind_view()
        self._covered_known = self._slots_known = self.is_whole = False
        self._left_as, self._clear_as = self._clear_as if self.drawn else None, None
        self._written.clear()
        self.is_lit = False
        self.stats = Stats()

    def restart(self) -> None:
        """Begin the picture anew, which is drawn once more: nothing that was written of it counts."""
        self._covered_known = self._slots_known = self.is_lit = False
        self._written.clear()
        self.stats.skipped.clear()

    def take_changes(self, wanted: dict[str, object]) -> frozenset[str]:
        """The names of what is wanted that is another than what is `drawn`, which nothing is from then on:
        whoever draws sets it anew when that is done."""
        before, self.drawn = self.drawn, {}
        return frozenset(
            name for name, value in wanted.items() if name not in before or before[name] != value
        )

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

    def show(self, pose: GpuPose, points: NDArray[np.uint32], octants: NDArray[np.uint32]) -> None:
        """Say that rows are those of another pose with the same origin: for a backend that shows octants in
        place of the points. points: the row of the point that each of them stands for, by whose index in the
        file it is known. octants: the number of each, 0xFFFFFFFF where it is none."""
        self._shown, self._stood_for = (pose, self.view), (self.pose, points)
        self._octants = octants

    def show_samples(self) -> None:
        """Say that rows are samples of the pose's range views: pixels, numbered view after view and row after
        row, whether they see a point or not. These are the ids of the points, none of which is merged for it.
        Colours are those of the pixels, normals those of the planes through the samples around. Raises
        InputError where there are no range views."""
        self.samples = self.pose.range_points

    def start_listed(self) -> IndexList:
        """Clear the picture, depths and rows, for a backend that lists the pixels that it covers at less than
        the cost of looking at every pixel; that list, whose slots may be no pixel, 0xFFFFFFFF, or the same.

        Where the picture before was listed as well, its pixels alone are cleared.
        """
        background = self.look.background
        if self._left_as == background:
            with self.gpu.timers.measure("clear"):
                self.bind_storage()
                self.picture.bind_to_storage_buffer(Storage.CLEARED_PICTURE)
                program = self.gpu.compute("shade/clear.comp")
                self.gpu.set(program, background=picture_word(background))
                self.covered.run(program)
        else:
            self.clear()
            gl.clear_words(self.picture, picture_word(background))
        self._clear_as, self._slots_known = background, True
        return self.covered

    def take_picture(self) -> moderngl.Buffer:
        """The picture, to write to pixels that are not covered too."""
        self._clear_as = None
        return self.picture

    def clear_picture(self, background: str) -> None:
        """Make the picture this colour, at least where nothing is shown."""
        if self._clear_as != background:
            gl.clear_words(self.picture, picture_word(background))
            self._clear_as = background if self._slots_known else None

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

    def take_sample(
        self, share: float, margin: float | None = None, reach: float = 0.0
    ) -> tuple[gl.BufferTexture | None, int]:
        """The rows to draw in place of all, for a backend that is asked for a share of the points:
        (their list, ascending; None where it is all of them, how many there are). Counts the others.

        margin, reach: how many pixels, and scan units, beyond the picture a point may be that it shows;
        points in chunks beyond are not listed. None for a backend that looks at points wherever they are.
        """
        count = len(self._cloud) if self.samples is None else int(self.samples.firsts[-1])
        near, asked = None, self.stats.asked
        if margin is not None and self.samples is None:
            near = self.pose.keep(Chunks).rows_in(self.view, margin, reach)
        if near is not None:
            self.stats.skipped["points"] = f"{count - len(near):,} of {count:,} are in chunks out of view"
            if share < 1:
                near = near[is_sampled(near, share)]
                self.stats.share, self.stats.left_out = share, round(count * asked) - round(count * share)
            return row_list(self.gpu).write(near), len(near)
        if share >= 1 or count < _FEW:
            return None, count
        rows, drawn = sample_of(self.gpu).take(share, count)
        points = count if self.samples is None else self.samples.count
        self.stats.share = share
        self.stats.left_out = round(points * asked) - round(points * drawn / count) if share < asked else 0
        return rows, drawn

    def clear(self) -> None:
        """Nothing anywhere."""
        gl.clear_words(self.depths.buffer, NO_DEPTH)
        gl.clear_words(self.rows.buffer, NOTHING)

    def raster(self) -> gl.Raster:
        """The framebuffer of backends that rasterise; `take_raster` makes it the Surface.

        Raises InputError for a picture that is too long for one.
        """
        if self._raster is None:
            width, height = self.size
            if max(self.size) > gl.max_raster_edge():
                raise InputError(
                    f"a picture of {width}x{height} pixels is too long to be rasterised; this driver "
                    f"takes {gl.max_raster_edge():,} pixels along an edge",
                    hint="Use a smaller --size, or --backend points",
                )
            raster = gl.Raster(self.gpu.ctx, self.size)
            self.gpu.check_memory(raster)
            self._raster = raster
        return self._raster

    def take_raster(self) -> None:
        """Copy what was rasterised into the Surface."""
        self.raster().copy_to(self.rows.buffer, self.depths.buffer)

    def keep(self, make: Callable[[Gpu, tuple[int, int]], W]) -> W:
        """Make, once, of the context and the size, what a backend works with from picture to picture. Counted
        and deleted with the surface."""
        if make not in self._kept:
            self._kept[make] = make(self.gpu, self.size)
        return self._kept[make]  # type: ignore[return-value]

    def own(self, name: str, is_lit: bool = False) -> gl.BufferTexture:
        """A channel that the backend writes itself in this frame for every covered pixel: it is shown in
        place of what the row has. Where nothing is, it is unread. is_lit: of colours, whether they are what
        the look asks for, coloured and lit by the backend itself: shading takes them as they are. As buffers:

        color: RGBA8, sRGB, the alpha being what it covers of the pixel
        normal: 3 floats, along the pose's axes, of any length; 0: unknown
        value: float, the number that is coloured by, in the terms of `row_values`; NaN: unknown
        level: uint32, 0 where measured; n, up to 254, where filled from level n, with a depth and no row
        """
        if name not in self._own:
            self._own[name] = self._texels(name)
        self._written.add(name)
        self.is_lit = self.is_lit or is_lit
        if name == "value":
            self._blended = self.value_source, self.look.up
        if name == "level":
            # A list of what points cover lacks what is filled.
            self._covered_known = self._slots_known = False
        return self._own[name]

    def bind_own(self, *names: str) -> None:
        """Bind channels that the backend writes itself for compute shaders to change."""
        for name in names:
            self.own(name).buffer.bind_to_storage_buffer(Storage[name.upper()])

    def is_own(self, name: str) -> bool:
        """Whether the backend wrote this channel for each pixel. Values are those of one source: they are not
        its own in a look that colours by another."""
        fits = name != "value" or self._blended == (self.value_source, self.look.up)
        return name in self._written and fits

    @property
    def wanted(self) -> str | None:
        """The name of the number that the look colours by where the backend finds it: `give` takes it. None
        where none of these is asked for."""
        source = self.value_source
        return source if source in self.finds else None

    def give(self, texels: gl.BufferTexture) -> None:
        """Take the number that is `wanted`, for a backend that finds it: a float for each row of the pose,
        NaN: unknown. Those of rows that no pixel has are unread. It stays the backend's, and as it is until
        the next picture."""
        assert self.wanted is not None
        self._given = self.wanted, texels

    @property
    def value_kind(self) -> ValueKind | None:
        """The kind of the number that the look colours by, where the backend finds it."""
        return self.finds.get(self.value_source or "")

    def resolve(self, name: str) -> gl.BufferTexture:
        """The channel `color`, `normal` or `value` as the backend's `own`, with what the rows have written to
        it: for one that goes on from there, as by filling pixels that have none."""
        own = self.own(name)
        self._resolve(name, own)
        return own

    def _resolve(self, name: str, target: gl.BufferTexture, stride: int | None = None) -> None:
        """Write what the rows have of a channel to a texel for each covered pixel. stride: to one for each
        of some pixels, covered or not: one in so many of each line, and of the lines."""
        by_sample = self.samples is not None and name != "value"
        texels = None if by_sample else self.row_values if name == "value" else self.pose.find(f"{name}s")
        defines = {
            "CHANNEL": _RESOLVED[name],
            "HAS_ROWS": int(texels is not None or (by_sample and not self._lacks(name))),
            "IS_DEPTH": int(name == "value" and self.value_source == "depth"),
            "SAMPLED": int(stride is not None),
            **self.sample_defines(by_sample),
        }
        program = self.gpu.compute("shade/resolve.comp", defines)
        with self.gpu.timers.measure(f"resolve {name}"):
            self.bind_textures()
            if by_sample:
                self.bind_samples()
            elif texels is not None:
                texels.bind(Texture.VALUES)
            target.buffer.bind_to_storage_buffer(Storage[name.upper()])
            self.gpu.set(program, plain=tuple(c / 255 for c in rgba(self.look.plain)[:3]))
            if stride is not None:
                self.gpu.set(program, stride=stride)
            self.gpu.dispatch(program, self._count(stride or 1))

    def _count(self, stride: int) -> int:
        """The number of pixels that one in so many of each line, and of the lines, are."""
        return -(-self.size[0] // stride) * -(-self.size[1] // stride)

    def _lacks(self, name: str) -> bool:
        """Whether the pixels of range views have no such channel."""
        return name == "color" and self.pose.overview.colors is None

    def sample_defines(self, used: bool) -> dict[str, object]:
        """Macros for programs that include range/of_rows.glsl. used: whether it is."""
        return {"SAMPLES": 1, **self.pose.samples.defines} if used else {"SAMPLES": 0}

    def bind_samples(self) -> None:
        """Bind all that range/of_rows.glsl reads."""
        self.pose.samples.bind(self.view)

    @property
    def value_source(self) -> str | None:
        """Source of the number that the look colours by ("depth", "height", a scalar's name, one of `finds`),
        else None."""
        return value_source(self.look, self.layers.names(self.pose.overview.scalars), self.finds)

    @property
    def values_key(self) -> tuple[object, ...]:
        """Key of what `row_values` and `resolve` give of a pose."""
        source = self.value_source
        axis = self.height_axis if source == "height" else None
        numbers = self.layers.scalars.get(source or "")
        return source, axis, None if numbers is None else self.scanned.layer(numbers), self.look.plain

    def take_look(self, look: Look) -> bool:
        """Be shaded in another look next, where what is drawn is the same for it; whether it is."""
        if (
            self.is_lit
            or wants_normals(look) != wants_normals(self.look)
            or is_lit(look) != is_lit(self.look)
        ):
            return False
        before, key = self.look, self.values_key
        self.look = look
        if self.values_key == key or not (self._written or self.wanted):
            return True
        self.look = before
        return False

    @property
    def value_zero(self) -> float:
        """Zero that values on the GPU are relative to. It is taken off in float64, so that heights and times
        far from zero keep their steps."""
        source = self.value_source
        if source == "height":
            return float(self.layers.world_from_pose.points(self.pose.origin) @ up_vector(self.look.up))
        if source == "depth":
            return self.view.base
        if source is None or source in self.finds:
            return 0.0
        return self.scalar_range(source, self.pose)[0]

    def found_range(self) -> tuple[float, float]:
        """The 2 % and 98 % quantiles of the number that the backend gave, among some of the pixels."""
        stride = -(-max(self.size) // _SAMPLED)
        texels = gl.BufferTexture(self.gpu.buffer(reserve=4 * self._count(stride)), gl.R32F)
        self._resolve("value", texels, stride)
        values = np.frombuffer(texels.buffer.read(), np.float32)
        self.gpu.discard(texels)
        return robust_range(values)

    def scalar_range(self, name: str, pose: GpuPose) -> tuple[float, float]:
        """The 2 % and 98 % quantiles of a layer's or else a pose's finite numbers."""
        layer = self.layers.scalars.get(name)
        return pose.scalar_range(name) if layer is None else self.scanned.layer(layer).range

    def scalar_texels(self, name: str) -> gl.BufferTexture:
        """The numbers of each row, of a layer or the scan, relative to `value_zero`."""
        layer = self.layers.scalars.get(name)
        if layer is None:
            return self.pose.array(f"{'scalar' if self.samples is None else 'sample'}:{name}")
        rows, zero = self._stood_for[1] if self._stood_for else None, self.scalar_range(name, self.pose)[0]
        return self.pose.layer_texels(layer, zero, rows, by_sample=self.samples is not None)

    @property
    def height_axis(self) -> tuple[float, float, float]:
        """The look's up along the pose's axes."""
        up = np.array(up_vector(self.look.up), np.float64)
        x, y, z = (float(v) for v in self.layers.world_from_pose.inverse.directions(up))
        return x, y, z

    @property
    def row_values(self) -> gl.BufferTexture | None:
        """The number of each row that the look colours by, a float relative to `value_zero`, for a backend
        that blends it into its own `value`. None where it colours by none, or by depth, which pixels have."""
        source = self.value_source
        if source in (None, "depth"):
            return None
        if source == "height":
            return self.pose.heights(self.height_axis, by_sample=self.samples is not None)
        return self._found_texels(source) if source in self.finds else self.scalar_texels(source)

    def _found_texels(self, name: str) -> gl.BufferTexture:
        if self._given is None or self._given[0] != name:
            raise InputError(
                f"'{name}' was not computed for this picture", hint="Draw it again with this look"
            )
        return self._given[1]

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        words = 3 + (3 if self._raster else 0) + sum(_CHANNELS[name][1] for name in self._own) // 4
        kept = sum(workspace.nbytes for workspace in self._kept.values())
        return 4 * self.size[0] * self.size[1] * words + self.covered.nbytes + kept

    @property
    def pose(self) -> GpuPose:
        """The pose that it shows."""
        return self._drawn()[0]

    @property
    def scanned(self) -> GpuPose:
        """The pose of the scan that it shows, be it by something made of its points."""
        return self._stood_for[0] if self._stood_for else self.pose

    @property
    def view(self) -> View:
        """The view that it shows it from."""
        return self._drawn()[1]

    def release(self) -> None:
        """Give up what it holds on the GPU now; otherwise that goes with the object."""
        nbytes = self.nbytes if self._resources else 0
        everything = (*self._resources, *self._own.values(), *self._kept.values(), self._raster)
        self.gpu.discard(*everything, nbytes=nbytes)
        self._resources, self._own, self._kept, self._raster = (), {}, {}, None

    def __del__(self) -> None:
        self.release()

    def _drawn(self) -> tuple[GpuPose, View]:
        if self._shown is None:
            raise RuntimeError("nothing was drawn to this surface")
        return self._shown

    @property
    def _cloud(self) -> PointCloud:
        return self.pose.cloud

    def _texels(self, name: str) -> gl.BufferTexture:
        """A channel of a texel for each pixel."""
        texel_format, size = _CHANNELS[name]
        buffer = self.gpu.buffer(reserve=size * self.size[0] * self.size[1])
        return gl.BufferTexture(buffer, texel_format)


def picture_word(color: str) -> int:
    """A colour of a look as a pixel of a picture."""
    return int.from_bytes(bytes(rgba(color)), "little")
