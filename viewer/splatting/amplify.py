"""Amplify: a feed brings each point to a shape, which makes it a quad or a cube (Slomp 2014, IV)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..gpu import gl
from ..gpu.bindings import Texture, UniformBlock, texture
from ..gpu.blocks import Values
from ..gpu.context import Program
from ..gpu.pose import GpuPose
from ..picture.surface import Surface
from ..scan.points import PointCloud

_STAGES = ("amplify/corner.vert",)
# Feed -> the stages that bring points to a shape, and the part of them that fetches points.
_FEEDS: dict[str, tuple[tuple[str, ...], dict[str, str]]] = {
    "gs": (("amplify/gs.vert", "amplify/gs.geom"), {}),
    "ubo": (_STAGES, {"feed": "amplify/feeds/ubo.glsl"}),
    "tbo": (_STAGES, {"feed": "amplify/feeds/tbo.glsl"}),
    "vbo": (_STAGES, {"feed": "amplify/feeds/vbo.glsl"}),
    "pull": (_STAGES, {"feed": "amplify/feeds/pull.glsl"}),
}
FEEDS = tuple(_FEEDS)
_WHOLE = ("ubo", "vbo")  # feeds that bring a pose's points one after the other, without choice
_ATTRIBUTE_FEEDS = ("gs", *_WHOLE)  # those that bring each array as an attribute
_BLOCK_BYTES = 1 << 16  # of a uniform block; some drivers allow less or more
_BLOCK_POINTS = 64  # ranges begin at multiples of 256 bytes, whatever a point takes
Attributes = tuple[tuple[str, str, int], ...]
# What a point has: name of the pose's array, of the vertex attribute, floats. The first two always, radii
# where points bring their own, half-axes where these are elliptical, cells where splats are fitted to them.
_ATTRIBUTES = (
    ("positions", "in_position", 3),
    ("normals", "in_normal", 3),
    ("radii", "in_radius", 1),
    ("axes", "in_axes", 4),
    ("cells", "in_cell", 4),
)
_COLOR = ("colors", "in_color", 4)  # bytes, where the feed brings colours as well


@dataclass(frozen=True)
class Shape:
    """Shape of a point. file: shader with `begin_shape` and `corner`. corners: of its triangle strip."""

    file: str
    corners: int


class ListedRows(gl.BufferTexture):
    """Rows in any order.

    ascending: gives the same ones ascending; None where they are. order_indices, arranged: the indices of
    those points in an order of their own, and all points in that order, as amplify/texels.glsl has them; None
    where points are read by rows.
    """

    ascending: Callable[[], gl.BufferTexture] | None = None
    order_indices: gl.BufferTexture | None = None
    arranged: gl.BufferTexture | None = None


@dataclass(frozen=True, eq=False)
class Points:
    """The points of a pose that are drawn.

    use_radii: whether they bring their own radius, or half-axes. count: how many. rows: which, None: all;
    ascending, or else `ListedRows`. enlarged: the factor on their size with which they together cover what
    all do.
    buffers: in place of the pose's arrays of these names, such as normals that a compute pass found;
    "cells", what surfels/cell.glsl reads, beside "radii" and "axes";
    "splats", normal, radius and half-axes of each row in three words, as amplify/packed.glsl reads them,
    in place of all three, but for the radii where these are given as well; "looks", colour and normal as
    surfels/passes/look.glsl reads them. elliptical: whether the half-axes of "splats" count; else they
    are round, of the shorter one. colored: whether the feed brings their colours as well, to fragments as
    `color`.
    """

    pose: GpuPose
    use_radii: bool
    count: int
    rows: gl.BufferTexture | None = None
    enlarged: float = 1.0
    buffers: Mapping[str, gl.BufferTexture] = field(default_factory=dict)
    elliptical: bool = True
    colored: bool = False

    @classmethod
    def of(
        cls,
        pose: GpuPose,
        surface: Surface,
        share: float,
        use_radii: bool,
        margin: float | None = None,
        reach: float = 0.0,
    ) -> Points:
        """A share of the points, as `Surface.take_sample` chooses them; 1: all. margin, reach: as there, of
        all points; those of a share are larger, and reach as much farther."""
        enlarged = 1 / math.sqrt(share)
        rows, count = surface.take_sample(share, margin, enlarged * reach)
        return cls(pose, use_radii, count, rows, enlarged if surface.stats.share < 1 else 1.0)

    def ascending(self) -> Points:
        """Points in the order of rows: of two at one depth the rasteriser keeps the first."""
        rows = self.rows
        if isinstance(rows, ListedRows) and rows.ascending is not None:
            return replace(self, rows=rows.ascending())
        return self

    @cached_property
    def _listed(self) -> ListedRows | None:
        """The rows where points are read in an order of their own."""
        return (
            self.rows if isinstance(self.rows, ListedRows) and self.rows.order_indices is not None else None
        )

    @cached_property
    def packed(self) -> bool:
        """Whether normals, radii and half-axes are those of "splats"."""
        return "splats" in self.buffers

    @cached_property
    def use_axes(self) -> bool:
        """Whether there are ellipses among them."""
        if self.packed:
            return self.use_radii and self.elliptical
        given = "axes" in self.buffers if "radii" in self.buffers else self.pose.has("axes")
        return self.use_radii and given

    @cached_property
    def use_cells(self) -> bool:
        """Whether splats are fitted to the cells of points."""
        return self.use_axes and "cells" in self.buffers

    def array(self, name: str) -> gl.BufferTexture:
        """positions, normals, radii, axes, cells or splats, indexed by row."""
        return self.buffers.get(name) or self.pose.array(name)

    @cached_property
    def attributes(self) -> Attributes:
        """Attributes that are read of each: (name of the pose's array, of the vertex attribute, numbers)."""
        read = _ATTRIBUTES[: 2 + self.use_radii + self.use_axes + self.use_cells]
        return (*read, _COLOR) if self.colored else read

    @property
    def stride(self) -> int:
        """Numbers of a point."""
        return sum(floats for _, _, floats in self.attributes)

    @cached_property
    def defines(self) -> dict[str, object]:
        """Macros for shaders that include amplify/attributes.glsl or amplify/texels.glsl."""
        return {
            "HAS_RADIUS": int(self.use_radii),
            "HAS_AXES": int(self.use_axes),
            "HAS_CELLS": int(self.use_cells),
            "PACKED": int(self.packed),
            "RADII_APART": int(self.use_radii and (not self.packed or "radii" in self.buffers)),
            "SAMPLED": int(self.rows is not None),
            "REORDERED": int(self._listed is not None),
            **({"FED_COLOR": 1} if self.colored else {}),
        }

    def bind(self, program: Program) -> None:
        """Bind what amplify/texels.glsl reads."""
        self.pose.gpu.set(program, enlarged=self.enlarged)
        if (listed := self._listed) is not None:
            assert listed.order_indices is not None
            assert listed.arranged is not None
            listed.arranged.bind(Texture.ARRANGED)
            listed.order_indices.bind(Texture.DRAWN_ROWS)
            return
        if self.packed:
            self._bind("positions")
            self.bind_radii()
        else:
            self._bind(*(name for name, _, _ in self.attributes))
        if self.rows is not None:
            self.rows.bind(Texture.DRAWN_ROWS)

    def bind_radii(self) -> None:
        """Bind what amplify/radii.glsl reads."""
        if self.packed:
            self._bind("splats")
        if self.defines["RADII_APART"]:
            self._bind("radii")

    def _bind(self, *names: str) -> None:
        for name in names:
            self.array(name).bind(texture(name))


def amplify(
    points: Points,
    surface: Surface,
    feed: str,
    shape: Shape,
    fragment: str,
    params: Values | None = None,
    over: bool = False,
) -> None:
    """Draw points as shapes, in id order with a strict depth test.

    feed: one of FEEDS. fragment: the shape's fragment shader, which writes a row and a depth. params: what
    both find in `<params>`. over: draw over what the surface holds.
    """
    gpu, feed = surface.gpu, usable_feed(points, feed, surface)
    with gpu.timers.measure("splat"):
        surface.raster().clear()
        gpu.ctx.enable_only(moderngl.DEPTH_TEST)
        if over:
            _restore(surface)
        gpu.ctx.depth_func = ">"  # reversed depth: near is 1
        draw_shapes(points, feed, shape, fragment, params)
    with gpu.timers.measure("copy"):
        surface.take_raster()


def _restore(surface: Surface) -> None:
    """Rasterise what the surface holds."""
    surface.bind_textures()
    surface.gpu.ctx.depth_func = "1"
    program = surface.gpu.program(("present/present.vert", "amplify/restore.frag"))
    with surface.gpu.vertices(program) as triangle:
        triangle.render(moderngl.TRIANGLES, vertices=3)


def draw_shapes(
    points: Points,
    feed: str,
    shape: Shape,
    fragment: str,
    params: Values | None = None,
    macros: Mapping[str, object] | None = None,
) -> None:
    """Draw points as shapes into the bound framebuffer, with the depth test and blending that are set, by the
    `fitting_feed`.

    macros: of the fragment shader.
    """
    gpu, feed, points = points.pose.gpu, fitting_feed(points, feed), points.ascending()
    stages, parts = _FEEDS[feed]
    defines = {**points.defines, **(macros or {}), "CORNERS": shape.corners}
    if feed == "ubo":
        defines |= {"STRIDE": points.stride, "POINTS": _block_points(points)}
    program = gpu.program((*stages, fragment), defines, {**parts, "shape": shape.file}, params)
    if not points.count:
        return
    gpu.set(program, enlarged=points.enlarged)
    if feed == "ubo":
        _draw_blocks(program, points, shape)
        return
    if feed in ("gs", "vbo"):
        content = _attributes(program, points, "/i" if feed == "vbo" else "")
    else:
        content = []
        points.bind(program)
    index = points.rows.buffer if feed == "gs" and points.rows is not None else None
    with gpu.vertices(program, content, index) as vertices:
        if feed == "gs":
            vertices.render(moderngl.POINTS, vertices=points.count)
        elif feed == "pull":
            vertices.render(moderngl.TRIANGLES, vertices=3 * (shape.corners - 2) * points.count)
        else:
            vertices.render(moderngl.TRIANGLE_STRIP, vertices=shape.corners, instances=points.count)


def fitting_feed(points: Points, feed: str) -> str:
    """The feed itself where it can bring these points, else `tbo`, which gives the same picture: in place of
    `ubo` and `vbo` where only some are drawn, of all that bring attributes where these are packed."""
    replaced = _ATTRIBUTE_FEEDS if points.packed else _WHOLE if points.rows is not None else ()
    return "tbo" if feed in replaced or (points.buffers and feed == "ubo") else feed


def usable_feed(points: Points, feed: str, surface: Surface) -> str:
    """The `fitting_feed`; the surface's statistics tell where it is another."""
    fitting = fitting_feed(points, feed)
    if fitting != feed:
        reason = (
            f"{fitting} instead of {feed}, because {feed} can draw only all points of a pose, in their order"
        )
        surface.stats.chosen["instancing"] = reason
    return fitting


def _attributes(
    program: moderngl.Program, points: Points, advance: str
) -> list[tuple[moderngl.Buffer, str, str]]:
    """Contents of a vertex array. advance: "/i" for the next value with each instance."""
    return [
        (points.array(name).buffer, f"{numbers}f{'1' if name == 'colors' else ''}{advance}", attribute)
        for name, attribute, numbers in points.attributes
        if attribute in program
    ]


def _draw_blocks(program: moderngl.Program, points: Points, shape: Shape) -> None:
    """Range after range of one buffer as a uniform block, a draw call each."""
    gpu, size = points.pose.gpu, _block_points(points)
    point_bytes = 4 * points.stride
    packed = points.pose.packed(_pack, points.attributes, size).buffer
    with gpu.vertices(program) as vertices:
        for first in range(0, points.count, size):
            offset = first * point_bytes
            packed.bind_to_uniform_block(UniformBlock.POINTS, offset=offset, size=size * point_bytes)
            gpu.set(program, first=first)
            shown = min(size, points.count - first)
            vertices.render(moderngl.TRIANGLE_STRIP, vertices=shape.corners, instances=shown)


def _block_points(points: Points) -> int:
    """Points of a uniform block."""
    block_bytes = min(_BLOCK_BYTES, gl.max_uniform_block_bytes())
    fitting = block_bytes // (4 * points.stride)
    return fitting - fitting % _BLOCK_POINTS


def _pack(cloud: PointCloud, attributes: Attributes, size: int) -> NDArray[np.float32]:
    """The attributes of each point one after the other, (ranges x points of a block, floats)."""
    packed = np.zeros((-(-len(cloud) // size) * size, sum(floats for *_, floats in attributes)), np.float32)
    arrays = [getattr(cloud, name).reshape(len(cloud), -1) for name, _, _ in attributes]
    packed[: len(cloud)] = np.concatenate(arrays, axis=1)
    return packed
