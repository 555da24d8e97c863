"""Shading: one look for the surfaces of all backends."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

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
)
from ..rigid import Rigid
from ..scan.ranges import robust_range
from .surface import Surface

# How shade.comp names where a colour, a number and the light come from.
_COLOR_CODES = {"plain": 0, "own": 1, "normal": 2, "value": 3, "id": 4}
_VALUE_CODES = {"depth": 0, "height": 1, "scalar": 2}
_MOST = float(np.finfo(np.float32).max)
_LIGHT_CODES = {"flat": 0, "head": 1, "fixed": 2}
_OWN = {name: f"OWN_{name.upper()}" for name in ("color", "normal", "value")}
_CHANNEL_TEXTURES = {"color": Texture.COLORS, "normal": Texture.NORMALS}


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


@dataclass(frozen=True)
class _Recipe:
    """How a surface is shaded in a look."""

    look: Look
    color: str  # where colours come from, one of _COLOR_CODES
    value: str | None  # the number that gives colours, one of _VALUE_CODES
    light: str  # one of _LIGHT_CODES
    eye_dome: bool
    by_level: bool
    by_log: bool

    @property
    def read(self) -> tuple[str, ...]:
        """The channels that shading reads."""
        is_lit = self.light != "flat" or self.color == "normal"
        return (*(["color"] if self.color == "own" else []), *(["normal"] if is_lit else []))


def shade(surface: Surface, look: Look) -> None:
    """Shade into `surface.picture`. Raises InputError for what the scan does not have."""
    surface.look, gpu = look, surface.gpu
    recipe = _recipe(surface, look)
    params = _shading(surface, recipe.look, recipe.by_log)
    program = gpu.compute("shade/shade.comp", _defines(surface, recipe), params=params)
    surface.bind_view()
    shown = surface.list_shown()
    with gpu.timers.measure("shade"):
        surface.bind_textures()
        _bind_channels(surface, recipe)
        _bind_colors(surface, recipe)
        surface.picture.bind_to_storage_buffer(Storage.PICTURE)
        surface.clear_picture(recipe.look.background)
        shown.run(program)
    if recipe.look.holes:
        _paint_holes(surface)
    surface.shaded_by = shade


def _recipe(surface: Surface, look: Look) -> _Recipe:
    """Resolve a look for a surface, and note the range of its colour map there."""
    source = surface.value_source
    value = source if source in (None, "depth", "height") else "scalar"
    if value == "height" and not surface.kind.has_positions:
        value = "scalar"
    surface.color_range = None if source is None else value_range(surface, look)
    kind = surface.value_kind
    by_log = surface.color_range is not None and kind is not None and kind.goes_by_log(*surface.color_range)
    color, by_level = _color_source(surface, look, source), look.color_by == "level"
    if surface.is_lit:
        color, by_level, look = "own", False, replace(look, light="flat", eye_dome=False)
    # Photographs have the light that they were taken in, and depth cameras measure normals too roughly.
    photographed = surface.kind.is_photograph and color == "own" and not by_level
    light = _light(surface, look, photographed)
    is_unlit = look.light == "auto" and light == "flat" and not photographed
    eye_dome = is_unlit if look.eye_dome is None else look.eye_dome
    return _Recipe(look, color, value, light, eye_dome, by_level, by_log)


def _color_source(surface: Surface, look: Look, source: str | None) -> str:
    """The source of colours, one of _COLOR_CODES. source: of the number that gives them."""
    if source is not None:
        return "value"
    if look.color_by not in ("auto", "level", "own"):
        return look.color_by
    has_colors = surface.pose.overview.colors is not None or surface.is_own("color")
    return "own" if has_colors else "plain"


def _light(surface: Surface, look: Look, photographed: bool) -> str:
    """The light, one of _LIGHT_CODES."""
    if look.light != "auto":
        return look.light
    stored = surface.pose.overview.normals is not None
    has_normals = stored or "normals" in surface.needs or surface.is_own("normal")
    return "head" if has_normals and not photographed else "flat"


def _fetches(surface: Surface, recipe: _Recipe) -> bool:
    """Whether the shader fetches a channel by the row of a pixel."""
    return any(not surface.is_own(name) for name in recipe.read)


def _defines(surface: Surface, recipe: _Recipe) -> dict[str, object]:
    return {
        "COLOR_BY": _COLOR_CODES[recipe.color],
        "VALUE": _VALUE_CODES[recipe.value or "scalar"],
        "BY_LOG": int(recipe.by_log),
        "LIGHT": _LIGHT_CODES[recipe.light],
        "EYE_DOME": int(recipe.eye_dome),
        "TURNED": int(not surface.layers.world_from_pose.is_identity),
        "HAS_IDS": int(surface.kind.of("ids") is not None),
        **surface.kind.defines(_fetches(surface, recipe)),
        "LEVEL_COLORS": len(LEVEL_COLORS) if recipe.by_level else 0,
        "OWN_LEVEL": int(recipe.by_level and surface.is_own("level")),
        **{define: int(surface.is_own(name)) for name, define in _OWN.items()},
    }


def _bind_channels(surface: Surface, recipe: _Recipe) -> None:
    """Bind colours and normals, the backend's own or those of the rows."""
    for name in recipe.read:
        texels = surface.own(name) if surface.is_own(name) else surface.kind.texels(name)
        if texels is not None:
            texels.bind(_CHANNEL_TEXTURES[name])
        elif not surface.kind.fetches(name):
            surface.pose.array(f"{name}s")  # which raises
    if _fetches(surface, recipe):
        surface.kind.bind(surface.view)
    if surface.is_own("color"):
        surface.own("color").bind(Texture.OWN_COLORS)


def _bind_colors(surface: Surface, recipe: _Recipe) -> None:
    """Bind the numbers that give colours, and the colours that they give."""
    gpu, pose = surface.gpu, surface.pose
    if surface.is_own("value"):
        surface.own("value").bind(Texture.VALUES)
    elif recipe.value == "scalar" and (values := surface.row_values) is not None:
        values.bind(Texture.VALUES)
    elif recipe.value == "height":
        pose.array("positions").bind(Texture.POSITIONS)
    if recipe.color == "id" and surface.kind.of("ids") is not None:
        pose.array("ids").bind(Texture.IDS)
    if recipe.value is not None:
        gpu.cached(_color_map, recipe.look.color_map).bind(Texture.COLOR_MAP)
    if recipe.by_level:
        gpu.cached(_level_colors, LEVEL_COLORS).bind(Texture.COLOR_MAP)
        if surface.is_own("level"):
            surface.own("level").bind(Texture.LEVELS)


def _paint_holes(surface: Surface) -> None:
    """Paint over the background in the picture's holes."""
    gpu, bits = surface.gpu, surface.cached(_PixelBits)
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
    return _shading_of(look, ends, surface.height_axis, surface.layers.world_from_pose)


@lru_cache(64)
def _shading_of(
    look: Look, ends: tuple[float, float], height_axis: tuple[float, float, float], motion: Rigid
) -> _Shading:
    """Values of a look, which most pictures share. ends: `value_range`."""
    return _Shading(
        plain=_fractions(look.plain),
        background=_fractions(look.background),
        height_axis=(*height_axis, 0.0),
        to_world=_columns(motion.rotation),
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


@lru_cache(256)
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
