"""Textures: whether the pictures that a mesh names give its points their colours, and how.

`vertices`: each vertex gets the colour of the texture there. `dense`: besides, Scan4D adds points on the
triangles, one a texel or as many as it may. The vertices keep their ids, and the points that are added follow
them. Frames with the same faces get the same points, so that ids mean the same in all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..contents import Material, PointContents, TextureContents
from ..texture import (
    PointsBetween,
    Samples,
    bilinear,
    means_of_rows,
    pixels_at,
    points_between,
    texels_covered,
    vertex_samples,
)
from .cloud import color_columns, normal_columns
from .record import Decision
from .sequence import Decided

KEY = "texture"
VERTICES, DENSE, NONE = "vertices", "dense", "none"
MOST_POINTS = 1_000_000  # that Scan4D adds to a scan of one frame
MOST_OF_SEQUENCE = 200_000  # that it adds to each frame of a sequence, so that it plays
_FINER = 16  # texels a vertex from which on Scan4D adds points
_COLORS = ("red", "green", "blue")
_WHITE = (1.0, 1.0, 1.0)
_REDUCTIONS = (4, 2)  # parts of the width and height of a picture
_LEAST_PIXELS = 1 << 20  # of a reduced picture
_SLACK = 1.5  # reduced texels between two points, at least


class _Picture(Protocol):
    @property
    def width(self) -> int: ...

    @property
    def height(self) -> int: ...

    @property
    def changed(self) -> tuple[int, int]: ...


class PictureReaders(NamedTuple):
    """Readers of pictures. Both raise InputError.

    look: reads the size of a picture. colors: reads (H, W, 3) sRGB bytes, or (H, W, 4) with alpha, in a part
    of the width and height: 1, 2 or 4.
    """

    look: Callable[[Path], _Picture]
    colors: Callable[[Path, int], NDArray[np.uint8]]


@dataclass(frozen=True, eq=False)
class _Plan:
    """Positions and pixels that frames with the same faces share.

    at_vertices: where vertices are sampled. between: the points that are added, perhaps none.
    sample_ends, point_ends: (G,), behind the last of both of each material. reductions: (G,), of its picture.
    """

    at_vertices: Samples
    between: PointsBetween
    sample_ends: NDArray[np.int64]
    point_ends: NDArray[np.int64]
    reductions: tuple[int, ...]


def paint(contents: PointContents, decided: Decided, pictures: PictureReaders) -> None:
    """Give the points the colours of their texture, as columns, and add points between them where decided.

    A picture that is missing or damaged is reported, and its material's colour stands in for it.
    """
    texture = contents.texture
    if texture is None or not any(material.image for material in texture.materials):
        return
    if decided.corrections.get(KEY) == NONE:
        decided.settle(KEY, lambda: Decision(KEY, NONE, "user", "--read"))
        return
    count = len(next(iter(contents.columns.values())))
    found = tuple(_looked_at(material.image, pictures, decided) for material in texture.materials)
    frame = _Frame(texture, count, found, _known_texels(found, decided), pictures, decided)
    if frame.texels.any():
        decision = decided.settle(KEY, lambda: _decide(contents, frame))
    else:
        decision = _without_pictures(texture)
        decided.note(decision)
    if decision.value == NONE:
        return
    plan = frame.plan(_most_points(decided) if decision.value == DENSE else 0)
    at_vertices, between = frame.colors(plan)
    usable = {one.image for one, picture in zip(texture.materials, found, strict=True) if picture}
    if decided.frames == 1 and usable and usable == {*frame.unread}:
        decided.replace(_without_pictures(texture))
        return
    for name in color_columns(contents.columns):
        del contents.columns[name]
    if len(plan.between):
        _add_points(contents, plan.between)
        at_vertices = np.concatenate([at_vertices, between])
    contents.columns.update(zip(_COLORS, at_vertices.T, strict=True))


def _decide(contents: PointContents, frame: _Frame) -> Decision:
    """Whether points get the colours of the texture, from the first frame with a picture."""
    texture, count, decided = frame.texture, frame.count, frame.decided
    names, stated = _names(texture), decided.corrections.get(KEY)
    most = _most_points(decided)
    if stated is not None:
        value = stated.partition(":")[0]
        plan = frame.plan(most if value == DENSE else 0)
        return Decision(KEY, value, "user", "--read", _counts(count, len(plan.between)))
    if _differ(contents):
        decided.note_unused(f"texture {names}")
        why = "The vertices already have their own colours"
        return Decision(KEY, NONE, "assumed", names, why, (VERTICES, DENSE))
    finer = float(frame.covered.sum()) / count
    if finer > _FINER and count < most:
        why = (
            f"{_counts(count, len(frame.plan(most).between))}. The texture has {finer:,.0f} texels per vertex"
        )
        return Decision(KEY, DENSE, "assumed", names, why, (VERTICES, NONE))
    if texture.is_named:
        return Decision(KEY, VERTICES, "neighbour", names, _counts(count, 0))
    why = "The file names no picture, but this picture has the same name as the file"
    return Decision(KEY, VERTICES, "assumed", names, why, (DENSE, NONE))


def _without_pictures(texture: TextureContents) -> Decision:
    """Decide about the colours of a frame of which no picture can be read."""
    why = "Scan4D cannot read the pictures of the materials"
    if len({material.color for material in texture.materials if material.color is not None}) < 2:
        return Decision(KEY, NONE, "assumed", _names(texture), why)
    why += ", and uses the colours of the materials"
    return Decision(KEY, VERTICES, "assumed", _names(texture), why, (NONE,))


def _names(texture: TextureContents) -> str:
    images = (material.image for material in texture.materials)
    return ", ".join(dict.fromkeys(image.name for image in images if image is not None))


def _counts(points: int, added: int) -> str:
    if not added:
        return (
            f"The file contains {points:,} points. Each point gets the colour of the texture at its position"
        )
    return f"The file contains {points:,} points. Scan4D adds {added:,} points between them"


def _most_points(decided: Decided) -> int:
    """How many points Scan4D may add to a frame."""
    _, _, stated = decided.corrections.get(KEY, "").partition(":")
    if stated:
        return int(stated)
    is_sequence = decided.frames > 1 and KEY not in decided.corrections
    return MOST_OF_SEQUENCE if is_sequence else MOST_POINTS


def _differ(contents: PointContents) -> bool:
    """Whether the vertices have colours of their own; programs write one colour for all beside a texture."""
    colors = [np.asarray(contents.columns[name]) for name in color_columns(contents.columns)]
    return any(len(column) and bool((column != column[0]).any()) for column in colors)


def _looked_at(image: Path | None, pictures: PictureReaders, decided: Decided) -> _Picture | None:
    if image is None:
        return None
    try:
        return pictures.look(image)
    except InputError as error:
        _report(image, error, decided)
        return None


def _known_texels(found: Sequence[_Picture | None], decided: Decided) -> NDArray[np.float64]:
    """Texels of the picture of each material, (G,), 0 where there is none.

    Where other frames have them, those of the first one: a picture that is missing or of another size leaves
    the points as they are.
    """
    known: dict[int, int] = decided.shared((KEY, "texels"), None, dict)
    for group, picture in enumerate(found):
        if picture is not None:
            known.setdefault(group, picture.width * picture.height)
    return np.array([known.get(group, 0) for group in range(len(found))], np.float64)


def _report(image: Path, error: InputError, decided: Decided) -> None:
    """Report a picture that cannot be read; in a sequence the first one, and record the other frames."""
    what = f"Scan4D cannot read the texture {image.name}: {error.what}"
    if decided.frames == 1:
        decided.report("assumed", what)
    elif decided.shared((KEY, "missing"), None, lambda: image) == image:
        decided.contradict(KEY, what)
    else:
        decided.contradict(KEY, "Scan4D cannot read a texture, and uses the colour of its material")


def _scaled(texels: NDArray[np.float64], materials: Sequence[Material]) -> NDArray[np.float64]:
    """Texels of the pictures (G,), as often as the positions cover them."""
    return texels * [abs(material.scale[0] * material.scale[1]) for material in materials]


def _placed(uv: NDArray, groups: NDArray[np.int64], materials: Sequence[Material]) -> NDArray:
    """Positions (S, 2) where the materials move them to."""
    scales = np.array([material.scale for material in materials], uv.dtype)
    offsets = np.array([material.offset for material in materials], uv.dtype)
    if (scales == 1).all() and not offsets.any():
        return uv
    return uv * scales[groups] + offsets[groups]


def _reduction(apart: float, pixels: float) -> int:
    """The part of its width and height in which a picture is read, for points so many texels apart."""
    usable = (
        part for part in _REDUCTIONS if _SLACK * part <= apart and pixels >= _LEAST_PIXELS * part * part
    )
    return next(usable, 1)


@dataclass(frozen=True, eq=False)
class _Frame:
    """A frame with a texture, whose pictures are read one after the other, so that few are in memory.

    count: vertices. found: the picture of each material, None where it cannot be read. texels: (G,), of all.
    unread: pictures that turned out to be damaged when they were read.
    """

    texture: TextureContents
    count: int
    found: Sequence[_Picture | None]
    texels: NDArray[np.float64]
    pictures: PictureReaders
    decided: Decided
    unread: list[Path] = field(default_factory=list)
    _plans: dict[int, _Plan] = field(default_factory=dict)

    @cached_property
    def covered(self) -> NDArray[np.float64]:
        """Texels that the triangles of each material cover, (G,)."""
        return texels_covered(self.texture.mesh, self.count, _scaled(self.texels, self.texture.materials))

    def plan(self, most: int) -> _Plan:
        """The positions at which the pictures are sampled. most: points that may be added."""
        if most not in self._plans:
            placed = [(material.scale, material.offset) for material in self.texture.materials]
            key = self.texture.mesh, self.count, self.texels.tolist(), placed, most
            self._plans[most] = self.decided.shared(KEY, key, lambda: self._new_plan(most))
        return self._plans[most]

    def _new_plan(self, most: int) -> _Plan:
        mesh, materials, groups = self.texture.mesh, self.texture.materials, len(self.texels)
        at_vertices = vertex_samples(mesh, self.count)
        at_vertices = at_vertices._replace(uv=_placed(at_vertices.uv, at_vertices.groups, materials))
        between = points_between(mesh, self.count, _scaled(self.texels, materials), most)
        samples = np.bincount(at_vertices.groups, minlength=groups)
        points = between.count_by_group(groups)
        between = replace(between, uv=_placed(between.uv, np.repeat(np.arange(groups), points), materials))
        apart = np.sqrt(self.covered / np.maximum(samples + points, 1))
        reductions = tuple(map(_reduction, apart.tolist(), self.texels.tolist()))
        return _Plan(at_vertices, between, np.cumsum(samples), np.cumsum(points), reductions)

    def colors(self, plan: _Plan) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """The colours of the vertices and of the points between, (.., 3)."""
        samples, between = plan.at_vertices, plan.between
        shown = np.empty((len(samples.rows), 3), np.float32)
        is_colored = np.ones(len(samples.rows), bool)
        added = np.empty((len(between), 3), np.uint8)
        own = points = slice(0, 0)
        for group, material in enumerate(self.texture.materials):
            own = slice(own.stop, int(plan.sample_ends[group]))
            points = slice(points.stop, int(plan.point_ends[group]))
            if own.start == own.stop and points.start == points.stop:
                continue
            image = self._read(group, plan.reductions[group])
            if image is None:
                color = np.array(material.color or _WHITE, np.float32) * 255
                shown[own], added[points] = color, np.rint(color)
                continue
            size, is_clamped = image.shape[:2], material.is_clamped
            key = plan, size, is_clamped
            is_colored[own] = np.isfinite(samples.uv[own]).all(axis=1)
            around = partial(bilinear, size, np.nan_to_num(samples.uv[own]), is_clamped)
            shown[own] = self.decided.shared((KEY, "around", group), key, around).of(image)
            inside = partial(pixels_at, size, between.uv[points], is_clamped)
            at = self.decided.shared((KEY, "inside", group), key, inside)
            added[points] = image.reshape(-1, image.shape[2])[:, :3].take(at, axis=0)
        if is_colored.all():
            return means_of_rows(samples.rows, shown, self.count), added
        return means_of_rows(samples.rows[is_colored], shown[is_colored], self.count), added

    def _read(self, group: int, part: int) -> NDArray[np.uint8] | None:
        """The picture of a material in a part of its size; None where it has none that can be read."""
        image, picture = self.texture.materials[group].image, self.found[group]
        if image is None or picture is None:
            return None
        key = image, picture.changed, part
        try:
            return self.decided.shared((KEY, group), key, lambda: self.pictures.colors(image, part))
        except InputError as error:
            self.unread.append(image)
            _report(image, error, self.decided)
            return None


def _add_points(contents: PointContents, between: PointsBetween) -> None:
    """Add points behind those of the file: they have means of the values around, and no colours yet."""
    normals, columns = normal_columns(contents.columns), contents.columns
    positions = [name for name in columns if name.lower() in ("x", "y", "z")]
    for names in (positions, normals, *([name] for name in {*columns} - {*positions, *normals})):
        of_file = [np.asarray(columns[name]) for name in names]
        if not of_file:
            continue
        count = len(of_file[0])
        joined = np.empty((count + len(between), len(names)), np.result_type(*of_file))
        for column, values in enumerate(of_file):
            joined[:count, column] = values
            between.interpolate(values, joined[count:, column])
        if names == normals:
            length = np.linalg.norm(joined[count:], axis=1, keepdims=True)
            joined[count:] /= np.where(length > 0, length, 1)
        columns.update(zip(names, joined.T, strict=True))
    if contents.topology is not None:
        contents.topology += f", {len(between)} points of a texture {between.name}"
