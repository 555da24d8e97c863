"""What backends write: depths and rows of each pixel, and what they have of their own."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from ..errors import InputError
from ..gpu import gl
from ..gpu.bindings import Texture, storage
from ..gpu.context import Gpu
from ..gpu.pose import GpuPose
from ..gpu.view import ViewBlock
from ..look import Look, ValueKind, is_lit, rgba, wants_normals
from ..scan.layers import NO_LAYERS, Layers
from ..scan.ranges import robust_range
from ..view import View
from .buffers import PictureBuffers
from .coloring import Coloring
from .rows import OctantRows, Octants, PartRows, PointRows, SampleRows
from .sample import is_sampled, row_list, sample_of
from .stats import Stats

_SAMPLED = 256  # pixels along the longer edge whose numbers tell a range
_FEW = 1000  # points of which none is left out: it would gain nothing, and they would be missed
_RESOLVED = {"color": 0, "normal": 1, "value": 2}  # as shade/resolve.comp numbers them


class RenderTarget(PictureBuffers, Coloring):
    """A picture's pixels as backends draw them, before shading.

    Colour, normal and value of a pixel are those of its row, unless the backend wrote its `own`. A pixel
    without a row is filled, and what the backend did not write of it is unknown.
    drawn: what the picture was made of, by name; empty before, and where drawing failed. is_whole: whether
    that is drawn in full, so that drawing it again would change nothing. needs: names of what the backend has
    of the pose, stored or estimated. is_lit: whether the backend's own colours are as the look asks for,
    light included. color_range: where the colour map began and ended when it was shaded, None without one.
    """

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        super().__init__(gpu, size)
        self._shown: tuple[PointRows, View] | None = None
        self.look = Look()
        self.layers = NO_LAYERS
        self.needs: Collection[str] = ()
        self.finds: Mapping[str, ValueKind] = {}
        self._given: tuple[str, gl.BufferTexture] | None = None  # which of these the backend gave
        self.color_range: tuple[float, float] | None = None
        self.stats = Stats()
        self._written: set[str] = set()
        self.is_lit = False
        self.drawn: dict[str, object] = {}
        self.is_whole = False
        self._blended: tuple[str | None, str] | None = None  # the source that its own values are of, and up

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
        self._shown = PointRows(pose), view
        self.look, self.layers = look or Look(), layers
        scalars = layers.names(pose.overview.scalars)
        self.finds = {name: kind for name, kind in (finds or {}).items() if name not in scalars}
        self._given = None
        self._block.write(ViewBlock.of(view))
        self.bind_view()
        self._covered_known = self._slots_known = self.is_whole = False
        self._left_as, self._clear_as = self._clear_as if self.drawn else None, None
        self._filled_as = None
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

    def show(self, octants: Octants) -> None:
        """Say that rows are octants, for a backend that shows these in place of the points."""
        self._shown = OctantRows(octants, self.pose), self.view

    def show_samples(self) -> None:
        """Say that rows are samples of the pose's range views, see `SampleRows`. Raises InputError if there
        are no range views."""
        self._shown = SampleRows(self.pose), self.view

    def take_sample(
        self, share: float, margin: float | None = None, reach: float = 0.0
    ) -> tuple[gl.BufferTexture | None, int]:
        """The rows to draw in place of all, for a backend that is asked for a share of the points:
        (their list, ascending; None where it is all of them, how many there are). Counts the others.

        margin, reach: how many pixels, and scan units, beyond the picture a point may be that it shows;
        points in chunks beyond are not listed. None for a backend that looks at points wherever they are.
        """
        count, asked = self.kind.count, self.stats.asked
        near = None if margin is None else self.kind.near(self.view, margin, reach)
        if near is not None:
            self.stats.skipped["points"] = (
                f"{count - len(near):,} of {count:,} points are in groups out of view"
            )
            if share < 1:
                near = near[is_sampled(near, share)]
                self.stats.share, self.stats.left_out = share, round(count * asked) - round(count * share)
            return row_list(self.gpu).write(near), len(near)
        if share >= 1 or count < _FEW:
            return None, count
        rows, drawn = sample_of(self.gpu).take(share, count)
        points = self.kind.point_count
        self.stats.share = share
        self.stats.left_out = round(points * asked) - round(points * drawn / count) if share < asked else 0
        return rows, drawn

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
            self.own(name).buffer.bind_to_storage_buffer(storage(name))

    def is_own(self, name: str) -> bool:
        """Whether the backend wrote this channel for each pixel. Values are those of one source: they are not
        its own in a look that colours by another."""
        fits = name != "value" or self._blended == (self.value_source, self.look.up)
        return name in self._written and fits

    def resolve(self, name: str) -> gl.BufferTexture:
        """The channel `color`, `normal` or `value` as the backend's `own`, with what the rows have written to
        it: for one that goes on from there, as by filling pixels that have none."""
        own = self.own(name)
        self._resolve(name, own)
        return own

    def resolve_shaded(self) -> None:
        """Resolve what shading reads of the rows, for poses whose arrays are in parts."""
        pose = self.pose
        if self.look.color_by == "id" and pose.has("ids"):
            raise InputError(
                "points that were left out of a scan this large have no colours by number",
                hint="Choose other colours",
            )
        if pose.has("colors"):
            self.resolve("color")
        if wants_normals(self.look) or (is_lit(self.look) and pose.overview.normals is not None):
            self.resolve("normal")
        if self.value_source not in (None, "depth"):
            self.resolve("value")

    def _resolve(self, name: str, target: gl.BufferTexture, stride: int | None = None) -> None:
        """Write what the rows have of a channel to a texel for each covered pixel. stride: to one for each
        of some pixels, covered or not: one in so many of each line, and of the lines."""
        for rows in self.kind.parts or (self.kind,):
            self._resolve_rows(rows, name, target, stride)

    def _resolve_rows(self, kind: PointRows, name: str, target: gl.BufferTexture, stride: int | None) -> None:
        """Write a channel of the pixels that show some of the rows."""
        is_value = name == "value"
        texels = self._values_by_row(kind) if is_value else kind.texels(name)
        is_fetched = not is_value and kind.fetches(name)
        defines = {
            "CHANNEL": _RESOLVED[name],
            "HAS_ROWS": int(texels is not None or is_fetched),
            "IS_DEPTH": int(is_value and self.value_source == "depth"),
            "SAMPLED": int(stride is not None),
            "PART": int(isinstance(kind, PartRows)),
            **kind.defines(not is_value),
        }
        program = self.gpu.compute("shade/resolve.comp", defines)
        with self.gpu.timers.measure(f"resolve {name}"):
            self.bind_textures()
            if not is_value:
                kind.bind(self.view)
            if texels is not None:
                texels.bind(Texture.VALUES)
            target.buffer.bind_to_storage_buffer(storage(name))
            self.gpu.set(program, plain=tuple(c / 255 for c in rgba(self.look.plain)[:3]))
            if stride is not None:
                self.gpu.set(program, stride=stride)
            if isinstance(kind, PartRows):
                self.gpu.set(program, first=kind.first, part_count=kind.count)
            self.gpu.dispatch(program, self._count(stride or 1))

    def found_range(self) -> tuple[float, float]:
        """The 2 % and 98 % quantiles of the number that the backend gave, among some of the pixels."""
        stride = -(-max(self.size) // _SAMPLED)
        texels = gl.BufferTexture(self.gpu.buffer(reserve=4 * self._count(stride)), gl.R32F)
        self._resolve("value", texels, stride)
        values = self.gpu.read(texels.buffer, np.float32)
        self.gpu.discard(texels)
        return robust_range(values)

    def _count(self, stride: int) -> int:
        """The number of pixels that one in so many of each line, and of the lines, are."""
        return -(-self.size[0] // stride) * -(-self.size[1] // stride)

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
    def pose(self) -> GpuPose:
        """The pose that it shows."""
        return self.kind.pose

    @property
    def kind(self) -> PointRows:
        """The kind of its rows: points, octants or samples."""
        return self._drawn()[0]

    @property
    def scanned(self) -> GpuPose:
        """The pose of the scan that it shows, be it by something made of its points."""
        return self.kind.scanned

    @property
    def view(self) -> View:
        """The view that it shows it from."""
        return self._drawn()[1]

    def _drawn(self) -> tuple[PointRows, View]:
        if self._shown is None:
            raise RuntimeError("no backend has drawn to this surface yet")
        return self._shown
