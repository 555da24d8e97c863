"""What of a pose, a look and parameters becomes code words: colours as materials, light, sizes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..codewords.encode import Elements, Encoding, Light, encode_elements
from ..codewords.lighting import Materials, map_palette, mapped, nearest_colors, palette_of
from ..codewords.stream import PLANE_BITS, WordStream
from ..codewords.tables import Steps
from ..geometry import up_vector
from ..look import Look, color_table, light_direction, rgba, value_source
from ..params import param, radius_scale_param
from ..srgb import bytes_from_light, light_from_bytes
from ..view import View
from .layers import NO_LAYERS, Layers
from .points import PointCloud
from .pose import Pose
from .ranges import robust_range
from .spacing import typical_spacing

_MOST_SIZES = 65  # of a table
_RADIUS_PER_SPACING = 1.5  # closes a surface that is evenly covered
_BEYOND = 1 / 16  # of the depths of the first picture, that a sequence's reach beyond them at each end
_LEAST_FILLED = 0.5  # of the depths of a sequence, that a picture fills
_WORSE = 1.5  # times the error of the first picture's colours, that a later one's may have
_LUMA = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True)
class Params:
    """Parameters of code words."""

    quality: str = param(
        "table",
        "Accuracy of discs. table: shapes, positions and depths are rounded to the steps of Maršík 2010; "
        "planes: outlines are exact, and each pixel has the depth of its disc's plane in 16 bits; "
        "exact: as planes, with depths in 24 bits",
        choices=("table", "planes", "exact"),
        title="Code table",
        sweep=("table", "planes", "exact"),
        group="Words",
        basic=True,
    )
    sizes: int = param(
        17,
        "Number of disc radii in the table of shapes",
        low=2,
        high=65,
        group="Words",
        when={"quality": ("table",)},
    )
    size_parts: int = param(
        2,
        "Number of disc radii in the table of shapes per pixel of radius",
        low=1,
        high=8,
        group="Words",
        when={"quality": ("table",)},
    )
    normals: int = param(
        61,
        "Number of values, which must be odd, in the table of shapes for each slope of a normal (n'x and "
        "n'y)",
        low=3,
        high=121,
        group="Words",
        when={"quality": ("table",)},
    )
    normal_parts: int = param(
        5,
        "Number of values in the table for slopes of a normal (n'x or n'y) from 0 to 1. A slope of 1 is "
        "a tilt of 45 degrees",
        low=1,
        high=20,
        group="Words",
        when={"quality": ("table",)},
    )
    radius: str = param(
        "own",
        "own: the scan's own radii, estimated if missing; uniform: one radius for all",
        choices=("own", "uniform"),
        group="Splats",
    )
    radius_scale: float = radius_scale_param(group="Splats", basic=True)
    cull_back: bool = param(False, "Leave out discs that face away from the viewer", group="Splats")
    window: int = param(
        16,
        "Number of lines of the picture that Scan4D draws in one step",
        low=8,
        high=64,
        affects="speed",
        group="Speed",
    )

    @property
    def steps(self) -> Steps:
        """Steps of the table. Raises InputError."""
        return Steps(self.sizes, self.size_parts, self.normals, self.normal_parts)

    def rules(self, samples: int = 1) -> Encoding:
        """Rules of encoding. samples: along the edge of a pixel. With several, the table has more sizes: then
        it reaches to the same radius, as far as a table may. Raises InputError."""
        bits = PLANE_BITS[0] if self.quality == "planes" else PLANE_BITS[-1]
        sizes = min(samples * (self.sizes - 1) + 1, max(self.sizes, _MOST_SIZES))
        steps = replace(self.steps, sizes=sizes)
        return Encoding(steps, self.quality != "table", self.radius_scale, self.cull_back, bits, samples)


class Shared:
    """The depths that Z stands for, and the materials, of the pictures of a sequence: shared by them, so that
    equal discs have equal words.

    Both are those of the first picture until a picture does not fit: its depths reach beyond them or fill
    less than half of them, or the materials show its colours much worse. Then those of that picture follow.
    """

    def __init__(self) -> None:
        self._depths: tuple[float, float] | None = None
        self._palette: NDArray[np.uint8] | None = None
        self._error = 0.0

    def range_of(self, near: float, far: float, perspective: bool) -> tuple[float, float]:
        """The depths that Z reaches between, for a picture between these."""
        count = np.reciprocal if perspective else np.positive
        start, end = (float(count(depth)) for depth in (near, far))
        if near == far:  # nothing is drawn, or a single depth
            return self._depths or (near, far)
        if self._depths is not None:
            low, high = sorted(float(count(depth)) for depth in self._depths)
            is_inside = low <= min(start, end) and max(start, end) <= high
            if is_inside and abs(end - start) >= _LEAST_FILLED * (high - low):
                return self._depths
        beyond = _BEYOND * (end - start)
        start, end = start - beyond, end + beyond
        if perspective:
            end = max(end, _BEYOND / far)
        self._depths = float(count(start)), float(count(end))
        return self._depths

    def palette_of(
        self, palette: NDArray[np.uint8], colors: NDArray[np.uint8]
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """The shared colours, and which of them each point is shown in, (N,). palette: the colours of this
        picture alone. colors: (N, 3) of its points."""
        if self._palette is not None:
            index = nearest_colors(self._palette, colors)
            if _color_error(self._palette[index], colors) <= _WORSE * self._error + 1:
                return self._palette, index
        index = nearest_colors(palette, colors)
        self._palette, self._error = palette, _color_error(palette[index], colors)
        return palette, index


def _color_error(shown: NDArray[np.uint8], wanted: NDArray[np.uint8]) -> float:
    """The root of the mean square of differences, levels."""
    return float(np.sqrt(np.square(shown.astype(np.float32) - wanted).mean())) if wanted.size else 0.0


def words_of(
    pose: Pose,
    view: View,
    look: Look,
    params: Params,
    layers: Layers = NO_LAYERS,
    shared: Shared | None = None,
    samples: int = 1,
) -> WordStream:
    """Code words of a pose as a view shows it; ids are rows of its cloud. view: from an origin of positions.
    shared: with other pictures of a sequence; None: the picture stands alone. samples: along the edge
    of a pixel, 1, 2 or 4.

    Points without a normal face the eye, those without a radius have one for all. Raises InputError for what
    the scan or the parameters do not allow.
    """
    materials, index, lights = word_look(pose, view, look, layers, shared)
    return encode_elements(
        elements_of(pose, view, params, index),
        view,
        materials,
        lights,
        params.rules(samples),
        background=rgba(look.background),
        range_of=None if shared is None else partial(shared.range_of, perspective=view.perspective),
    )


def elements_of(pose: Pose, view: View, params: Params, materials: NDArray[np.uint8]) -> Elements:
    """The points of a pose as elements. materials: (N,), of each."""
    cloud, own = pose.cloud, params.radius != "uniform"
    if (cloud.origin != view.origin).any():
        cloud = cloud.centered(view.origin)
    return Elements(
        positions=cloud.positions,
        materials=materials,
        normals=cloud.normals,
        radii=cloud.radii if own else None,
        axes=cloud.axes if own else None,
        radius=uniform_radius(pose.cloud, params),
    )


def uniform_radius(cloud: PointCloud, params: Params) -> float:
    """The radius of points without one of their own, scan units; 1 where there is none of these."""
    suffices = params.radius != "uniform" and cloud.remember(_has_all_radii)
    return 1.0 if suffices or not len(cloud) else _RADIUS_PER_SPACING * cloud.remember(typical_spacing)


def _has_all_radii(cloud: PointCloud) -> bool:
    return cloud.radii is not None and bool((cloud.radii > 0).all())


class WordLook(NamedTuple):
    """A look, as code words have it."""

    materials: Materials
    assigned: NDArray[np.uint8]  # (N,), the material of each point
    light: Light


def word_look(
    pose: Pose, view: View, look: Look, layers: Layers = NO_LAYERS, shared: Shared | None = None
) -> WordLook:
    """The look of a pose in code words. shared: see `words_of`. Raises InputError for a number that the pose
    does not have."""
    palette, index = point_materials(pose, view, look, layers)
    if shared is not None:
        is_own = value_source(look, {**pose.cloud.scalars, **layers.scalars}) is None
        is_own &= look.color_by not in ("plain", "normal", "id", "level")
        colors = pose.cloud.colors if is_own else None
        palette, index = shared.palette_of(palette, palette[index] if colors is None else colors[:, :3])
    lights = word_lights(look, pose.cloud.normals is not None)
    shares = (look.ambient, look.diffuse, look.specular) if lights.is_lit else (0.0, 1.0, 0.0)
    return WordLook(Materials.of_palette(palette, *shares), index, lights)


def word_lights(look: Look, has_normals: bool) -> Light:
    """The light of a look; automatic: from the eye where there are normals. Eye-dome lighting, which needs
    the depths around a pixel, is none of words'."""
    kind = look.light if look.light != "auto" else "head" if has_normals else "flat"
    direction = light_direction(look) if kind == "fixed" else None
    return Light(direction, look.shininess, kind != "flat")


def point_materials(
    pose: Pose, view: View, look: Look, layers: Layers = NO_LAYERS
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Colours of materials, (M, 3) sRGB, and the material of each point, (N,): what the look colours by.

    Up to 128 colours of points stay as they are; of more, 128 are chosen. Numbers have 127 colours of
    the look's map. Raises InputError for a number that the pose has not.
    """
    cloud, scalars = pose.cloud, {**pose.cloud.scalars, **layers.scalars}
    source = value_source(look, scalars)
    if source is not None:
        values, low, high = _values(pose, view, look, layers, source)
        table = map_palette(color_table(look.color_map), rgba(look.plain))
        return table, mapped(values, low, high)
    if look.color_by == "normal" and cloud.normals is not None:
        return palette_of(_direction_colors(layers.world_from_pose.directions(cloud.normals)))
    if look.color_by == "id":
        return palette_of(_id_colors(np.arange(len(cloud)) if cloud.ids is None else cloud.ids))
    if look.color_by in ("plain", "normal") or cloud.colors is None:
        return np.array([rgba(look.plain)[:3]], np.uint8), np.zeros(len(cloud), np.uint8)
    palette, index = own_palette(cloud)
    if look.color_by == "level":  # all of it was measured, which is grey
        grey = bytes_from_light(light_from_bytes(palette) @ _LUMA)
        return np.repeat(grey[:, None], 3, axis=1), index
    return palette, index


def own_palette(cloud: PointCloud) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """The palette of the points' own colours, (M, 3), and the entry of each point, (N,). Found once."""
    return cloud.remember(_own_palette)


def _own_palette(cloud: PointCloud) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    assert cloud.colors is not None
    return palette_of(cloud.colors)


def _values(pose: Pose, view: View, look: Look, layers: Layers, source: str) -> tuple[NDArray, float, float]:
    """Numbers of all points that a look colours by, and the ends of its colour map."""
    if source == "depth":
        relative = pose.cloud.positions + (pose.origin - view.origin)
        values = view.depths(relative) + view.base
    elif source == "height":
        values = layers.world_from_pose.points(pose.cloud.world()) @ up_vector(look.up)
    else:
        values = np.asarray({**pose.cloud.scalars, **layers.scalars}[source], np.float64)
    low, high = look.low, look.high
    if low is None or high is None:
        found = robust_range(values)
        low, high = found[0] if low is None else low, found[1] if high is None else high
    return values, low, high


def _direction_colors(normals: NDArray[np.floating]) -> NDArray[np.uint8]:
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        unit = np.nan_to_num(normals / length, nan=0.0, posinf=0.0, neginf=0.0)
    return np.rint((0.5 * unit + 0.5).clip(0, 1) * 255).astype(np.uint8)


def _id_colors(ids: NDArray[np.integer]) -> NDArray[np.uint8]:
    """Colours that tell neighbouring numbers apart, as shade/shade.comp has them."""
    mixed = ids.astype(np.uint32) * np.uint32(2654435761)
    mixed ^= mixed >> np.uint32(16)
    parts = mixed[:, None] >> np.array([0, 8, 16], np.uint32)
    return (64 + (parts & np.uint32(127)) * 3 // 2).astype(np.uint8)
