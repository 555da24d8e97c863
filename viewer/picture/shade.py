"""Shading: one look for the surfaces of all backends."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..geometry import up_vector
from ..gpu import gl
from ..gpu.bindings import Storage, Texture
from ..gpu.blocks import Mat4, Vec4
from ..gpu.context import Gpu
from ..look import (
    HOLE_COLOR,
    HOLE_REACH,
    LEVEL_COLORS,
    Look,
    color_table,
    light_direction,
    rgba,
    value_source,
)
from ..scan.ranges import robust_range
from .surface import Surface

# How shade.comp names where a colour, a number and the light come from.
_COLOR_CODES = {"plain": 0, "own": 1, "normal": 2, "value": 3, "id": 4}
_VALUE_CODES = {"depth": 0, "height": 1, "scalar": 2}
_MOST = float(np.finfo(np.float32).max)
_LIGHT_CODES = {"flat": 0, "head": 1, "fixed": 2}


@dataclass(frozen=True)
class _Shading:
    """Values of a look as shade.comp gets them.

    plain, background: sRGB and alpha. height_axis: up, along the pose's axes. to_world: turns these. light:
    towards it, view space. phong: ambient, diffuse, specular, shininess. value_range: of the colour map,
    relative to the zero that values are stored from, or their binary logarithms.
    """

    plain: Vec4
    background: Vec4
    height_axis: Vec4
    to_world: Mat4
    light: Vec4
    phong: Vec4
    value_range: tuple[float, float]
    eye_dome_strength: float
    eye_dome_radius: int


def shade(surface: Surface, look: Look) -> None:
    """Shade into `surface.picture`. Raises InputError for what the scan does not have."""
    pose, gpu = surface.pose, surface.gpu
    cloud = pose.overview
    source, surface.look = value_source(look, surface.layers.names(cloud.scalars), surface.finds), look
    value = source if source in (None, "depth", "height") else "scalar"
    if value == "height" and surface.samples is not None:
        value = "scalar"  # which have no positions
    by_level = look.color_by == "level"
    color = "value" if source is not None else "own" if look.color_by in ("auto", "level") else look.color_by
    if color == "own" and cloud.colors is None and not surface.is_own("color"):
        color = "plain"
    if surface.is_lit:
        color, by_level, look = "own", False, replace(look, light="flat", eye_dome=False)
    # Photographs have the light that they were taken in, and what depth cameras measure is rougher than that.
    photographed = surface.samples is not None and color == "own" and not by_level
    has_normals = cloud.normals is not None or "normals" in surface.needs or surface.is_own("normal")
    lit = has_normals and not photographed
    light = look.light if look.light != "auto" else "head" if lit else "flat"
    unlit = look.light == "auto" and light == "flat" and not photographed
    eye_dome = unlit if look.eye_dome is None else look.eye_dome
    lit = light != "flat" or color == "normal"
    read = [name for name, is_read in (("color", color == "own"), ("normal", lit)) if is_read]
    from_rows = [name for name in read if not surface.is_own(name)]
    by_sample = surface.samples is not None and bool(from_rows)
    has_ids = cloud.ids is not None and surface.samples is None
    surface.color_range = None if source is None else value_range(surface, look)
    kind = surface.value_kind
    by_log = surface.color_range is not None and kind is not None and kind.goes_by_log(*surface.color_range)
    program = gpu.compute(
        "shade/shade.comp",
        {
            "COLOR_BY": _COLOR_CODES[color],
            "VALUE": _VALUE_CODES[value or "scalar"],
            "BY_LOG": int(by_log),
            "LIGHT": _LIGHT_CODES[light],
            "EYE_DOME": int(eye_dome),
            "TURNED": int(not surface.layers.world_from_pose.is_identity),
            "HAS_IDS": int(has_ids),
            **surface.sample_defines(by_sample),
            "LEVEL_COLORS": len(LEVEL_COLORS) if by_level else 0,
            "OWN_LEVEL": int(by_level and surface.is_own("level")),
            **{f"OWN_{name.upper()}": int(surface.is_own(name)) for name in ("color", "normal", "value")},
        },
        params=_shading(surface, look, by_log),
    )
    surface.bind_view()
    shown = surface.list_shown()
    with gpu.timers.measure("shade"):
        surface.bind_textures()
        for name, texture in (("color", Texture.COLORS), ("normal", Texture.NORMALS)):
            if name in read and surface.is_own(name):
                surface.own(name).bind(texture)
            elif name in read and surface.samples is None:
                pose.array(f"{name}s").bind(texture)
        if by_sample:
            surface.bind_samples()
        if surface.is_own("color"):
            surface.own("color").bind(Texture.OWN_COLORS)
        if surface.is_own("value"):
            surface.own("value").bind(Texture.VALUES)
        elif value == "scalar" and (values := surface.row_values) is not None:
            values.bind(Texture.VALUES)
        elif value == "height":
            pose.array("positions").bind(Texture.POSITIONS)
        if color == "id" and has_ids:
            pose.array("ids").bind(Texture.IDS)
        if value is not None:
            gpu.keep(_color_map, look.color_map).bind(Texture.COLOR_MAP)
        if by_level:
            gpu.keep(_level_colors, LEVEL_COLORS).bind(Texture.COLOR_MAP)
            if surface.is_own("level"):
                surface.own("level").bind(Texture.LEVELS)
        surface.picture.bind_to_storage_buffer(Storage.PICTURE)
        surface.clear_picture(look.background)
        shown.run(program)
    if look.holes:
        _paint_holes(surface)
    surface.shaded_by = shade


def _paint_holes(surface: Surface) -> None:
    """Paint over the background in the picture's holes."""
    gpu, bits = surface.gpu, surface.keep(_PixelBits)
    with gpu.timers.measure("holes"):
        surface.depths.bind(Texture.DEPTHS)
        surface.take_picture().bind_to_storage_buffer(Storage.PICTURE)
        bits.buffer.bind_to_storage_buffer(Storage.PIXEL_BITS)
        for step in range(3):
            program = gpu.compute("shade/holes.comp", {"STEP": step, "HOLE_REACH": HOLE_REACH})
            gpu.set(program, hole_color=_fractions(HOLE_COLOR))
            gpu.dispatch(program, bits.words)


class _PixelBits:
    """Two bits for each pixel of a picture, in words of 32 pixels of a row."""

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self.words = -(-size[0] // 32) * size[1]
        self.nbytes = 8 * self.words
        self.buffer = gpu.buffer(reserve=self.nbytes)

    def release(self) -> None:
        self.buffer.release()


def _shading(surface: Surface, look: Look, by_log: bool) -> _Shading:
    low, high = surface.color_range or (0.0, 1.0)
    zero = surface.value_zero
    ends = (math.log2(low), math.log2(high)) if by_log else (_finite(low - zero), _finite(high - zero))
    return _Shading(
        plain=_fractions(look.plain),
        background=_fractions(look.background),
        height_axis=(*surface.height_axis, 0.0),
        to_world=_columns(surface.layers.world_from_pose.rotation),
        light=(*light_direction(look), 0.0),
        phong=(look.ambient, look.diffuse, look.specular, look.shininess),
        value_range=ends,
        eye_dome_strength=look.eye_dome_strength,
        eye_dome_radius=look.eye_dome_radius,
    )


def _columns(rotation: NDArray[np.float64]) -> Mat4:
    """A rotation, (3, 3), as shaders hold it."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation.T
    return tuple(tuple(float(v) for v in column) for column in matrix)  # type: ignore[return-value]


def _finite(value: float) -> float:
    """The nearest number that a shader holds."""
    return min(max(value, -_MOST), _MOST)


def _fractions(color: str) -> Vec4:
    """A colour of a look, each channel from 0 to 1."""
    red, green, blue, alpha = (c / 255 for c in rgba(color))
    return red, green, blue, alpha


def value_range(surface: Surface, look: Look) -> tuple[float, float]:
    """(low, high) of the colour map: the look's own, else the 2 % and 98 % quantiles of the scan's points; of
    what the backend finds, the usual ones of its kind, else the quantiles of what is seen."""
    pose, source = surface.scanned, surface.value_source
    if look.low is not None and look.high is not None:
        return look.low, look.high
    if kind := surface.value_kind:
        low, high = kind.range or surface.found_range()
    elif source == "depth":
        low, high = robust_range(surface.view.depths(pose.sample) + surface.view.base)
    elif source == "height":
        world = surface.layers.world_from_pose.points(pose.sample + pose.origin)
        low, high = robust_range(world @ up_vector(look.up))
    else:
        low, high = surface.scalar_range(source or "", pose)
    return (low if look.low is None else look.low, high if look.high is None else look.high)


def _color_map(gpu: Gpu, name: str) -> gl.BufferTexture:
    return gl.BufferTexture(gpu.buffer(color_table(name)), gl.RGBA8)


def _level_colors(gpu: Gpu, colors: tuple[str, ...]) -> gl.BufferTexture:
    return gl.BufferTexture(gpu.buffer(bytes(byte for color in colors for byte in rgba(color))), gl.RGBA8)
