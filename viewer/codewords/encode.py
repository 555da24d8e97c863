"""Encoding: from points and a view to a stream of code words.

This is the part that works with fractions, float64: projection, the two light terms, and what is rounded of
these. Each number that goes into a word is one fraction rounded to the nearest step (halves to even) after it
was held within its range, and nothing is decided by comparing two fractions of different elements but for the
least and the largest depth. A last bit that another machine rounds otherwise moves one element by one step in
one field; what follows is whole numbers.

    x, y            the centre, to the nearest corner of pixels: off by half a pixel at most in each
    size, normal    of the disc whose image is the element's ellipse, to first order round its centre; see
                    `tables`. n' is held within the table's range, along its direction
    Z               what is linear over planes in the picture, 0 to 511 over the range of all centres drawn
    DIFFUSE, ...    127 times cosine and highlight

With exact outlines size and normal are not rounded, nor is the centre: a pixel is covered where its centre is
inside of the disc's image, perspective included, and the disc behind the near plane there; depth follows the
disc's plane, see `WordStream.finer`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..view import View
from .engine import NO_KEY, draw_words
from .lighting import Materials
from .stream import FINE_DEPTHS, PLANE_BITS, STEEPEST_DEPTHS, WordStream, check_picture_size, strip_width
from .tables import PAPER, Steps, shape_table
from .words import DEPTHS

LEAST_RADIUS = 0.7072  # pixels: a smaller disc may miss all pixel centres
MOST_WORDS = 1 << 27  # of a picture


@dataclass(frozen=True, eq=False)
class Elements:
    """Points with what code words need of them, N of each.

    positions: (N, 3) float32, relative to the view's origin. normals: (N, 3) float32, or None; a missing one
    faces the eye. radii: (N,) float32, scan units, or None. axes: (N, 4) float32 half-axes of ellipses, as
    `PointCloud` has them, or None. materials: (N,) uint8. radius: of points without one of their own.
    """

    positions: NDArray[np.float32]
    materials: NDArray[np.uint8]
    normals: NDArray[np.float32] | None = None
    radii: NDArray[np.float32] | None = None
    axes: NDArray[np.float32] | None = None
    radius: float = 1.0


@dataclass(frozen=True)
class Light:
    """White light on code words. direction: towards it, view space; None: it is where the eye is.
    shininess: Phong's exponent. is_lit: False: all words are as bright as their materials' diffuse colour."""

    direction: tuple[float, float, float] | None = None
    shininess: float = 24.0
    is_lit: bool = True


@dataclass(frozen=True, eq=False)
class Projected:
    """Elements that a picture may show, M of them, projected and in steps.

    rows: (M,) uint32, which ones. shapes: (M, 7) int32, and planes: (M, 15) float64, see `project_kernels`.
    near, far: depths from the view's base that the least and the largest Z stand for, scan units.
    """

    rows: NDArray[np.uint32]
    shapes: NDArray[np.int32]
    planes: NDArray[np.float64]
    near: float
    far: float


@dataclass(frozen=True)
class Encoding:
    """Rules by which elements become code words.

    steps: of sizes and normals. exact: whether outlines and depths are not rounded to steps, see above.
    radius_scale: factor on radii. cull_back: whether elements that face away are left out. depth_bits: of the
    depth buffer of exact outlines, see `WordStream`. samples: along the edge of a pixel, 1, 2 or 4.
    """

    steps: Steps = PAPER
    exact: bool = False
    radius_scale: float = 1.0
    cull_back: bool = False
    depth_bits: int = PLANE_BITS[-1]
    samples: int = 1


class EmittedWords(NamedTuple):
    """Code words of elements, as `WordStream` has them."""

    line_starts: NDArray[np.int64]
    words: NDArray[np.uint64]
    ids: NDArray[np.uint32]
    finer: NDArray[np.int32] | None


def encode_elements(
    elements: Elements,
    view: View,
    materials: Materials,
    light: Light = Light(),  # a frozen value
    rules: Encoding = Encoding(),  # a frozen value
    *,
    background: tuple[int, int, int, int] = (0, 0, 0, 255),
    range_of: Callable[[float, float], tuple[float, float]] | None = None,
) -> WordStream:
    """Code words of what a view shows of some points; ids are their rows. Float64 throughout.

    range_of: gives the depths that the least and the largest Z stand for, scan units from the eye, for the
    least and the largest depth that are drawn; None: they are these. Raises InputError where there are too
    many words.
    """
    view = _of_samples(view, rules.samples)
    check_picture_size(view.size)
    found = project_elements(elements, view, light, rules)
    stream = _stream(found, elements, view, materials, rules)
    if rules.exact and rules.depth_bits < PLANE_BITS[-1]:
        found = _within_sight(found, stream, view)
    if range_of is not None:
        near, far = range_of(found.near + view.base, found.far + view.base)
        found = replace(found, near=near - view.base, far=far - view.base)
    if (found.near + view.base, found.far + view.base) != (stream.near, stream.far):
        stream = _stream(found, elements, view, materials, rules)
    return replace(stream, background=background, depth_bits=rules.depth_bits)


def _stream(
    found: Projected, elements: Elements, view: View, materials: Materials, rules: Encoding
) -> WordStream:
    """Code words of projected elements, whose depths count from `found.near` to `found.far`."""
    depths, finer = _depths(found.planes, found.near, found.far, view.perspective, rules.exact)
    emitted = emit_words(found, elements.materials, view.size, rules.steps, depths, finer)
    return WordStream(
        size=view.size, stride=strip_width(view.size[0]), **emitted._asdict(), near=found.near + view.base,
        far=found.far + view.base, materials=materials, perspective=view.perspective, camera=_camera(view),
        samples=rules.samples,
    )  # fmt: skip


def _within_sight(found: Projected, stream: WordStream, view: View) -> Projected:
    """The elements with depths that count between the least and the largest one that a picture shows, so that
    the steps of a small depth buffer are not spent on what is hidden; but on no less than 1/16 of all depths.
    """
    keys = draw_words(stream).keys
    keys = keys[keys != NO_KEY]
    if not len(keys):
        return found
    low, high = int(keys.min()), max(int(keys.max()), int(keys.min()) + FINE_DEPTHS // 16)
    near, far = (float(depth) - view.base for depth in stream.depths(np.array([low, high])))
    return replace(found, near=near, far=far)


def _of_samples(view: View, samples: int) -> View:
    """The view whose pixels are the samples of a view's pixels, so many along an edge."""
    if samples == 1:
        return view
    width, height = view.size
    right, down = view.shift
    return replace(
        view, size=(width * samples, height * samples), scale=view.scale * samples,
        shift=(right * samples, down * samples),
    )  # fmt: skip


def _camera(view: View) -> NDArray[np.float64]:
    """See `WordStream.camera`."""
    away = view.translation - view.rotation @ view.origin - [0.0, 0.0, view.base]
    return np.concatenate([[view.scale], view.center, np.column_stack([view.rotation, away]).ravel()])


def project_elements(elements: Elements, view: View, light: Light, rules: Encoding = Encoding()) -> Projected:
    """The elements that a view may show, in steps; arguments as those of `encode_elements`."""
    from .outline_kernels import PLANE_COLUMNS, PictureView
    from .project_kernels import (
        SHAPE_COLUMNS,
        ElementArrays,
        LightRules,
        ProjectedArrays,
        SplatRules,
        project,
    )

    count = len(elements.positions)
    arrays = ElementArrays(
        np.column_stack([view.rotation, view.translation]),
        elements.positions,
        np.empty((0, 3), np.float32) if elements.normals is None else elements.normals,
        np.empty(0, np.float32) if elements.radii is None else elements.radii,
        np.empty((0, 4), np.float32) if elements.axes is None else elements.axes,
    )
    picture = PictureView(
        width=int(view.size[0]), height=int(view.size[1]),
        center_x=float(view.center[0]), center_y=float(view.center[1]), scale=float(view.scale),
        near=float(view.near), far=float(view.far), perspective=bool(view.perspective),
    )  # fmt: skip
    splats = SplatRules(
        float(elements.radius), float(rules.radius_scale), LEAST_RADIUS, rules.steps.size_parts,
        rules.steps.steepest, rules.steps.normal_parts, bool(rules.cull_back), bool(rules.exact),
    )  # fmt: skip
    towards = np.array(light.direction or (0.0, 0.0, 1.0), np.float64)
    lit = LightRules(float(light.shininess), bool(light.is_lit), light.direction is None)
    out = ProjectedArrays(
        np.empty(count, np.uint32),
        np.empty((count, SHAPE_COLUMNS), np.int32),
        np.empty((count, PLANE_COLUMNS)),
        np.empty(2),
    )
    drawn = project(arrays, picture, splats, lit, towards, out)
    near, far = (float(end) for end in out.spread) if drawn else (1.0, 1.0)
    return Projected(out.rows[:drawn], out.shapes[:drawn], out.planes[:drawn], near, far)


def emit_words(
    found: Projected,
    materials: NDArray[np.uint8],
    size: tuple[int, int],
    steps: Steps,
    depths: NDArray[np.int32],
    finer: NDArray[np.float64] | None = None,
) -> EmittedWords:
    """Code words of projected elements.

    materials: (N,) of all points. size: of the picture. depths: (M,), Z of each. finer: (M, 3), in steps, at
    the corner and a pixel right and down, of exact outlines; None: they are those of the table. Raises
    InputError where there are too many words.
    """
    from .emit_kernels import EmittedElements, TableArrays, WordArrays, emit

    width, height = size
    stride, exact, shapes = strip_width(width), finer is not None, shape_table(steps)
    parts = np.array([steps.size_parts, steps.steepest, steps.normal_parts])
    table = TableArrays(shapes.entries, shapes.rows, shapes.reach, parts)
    given = EmittedElements(
        found.rows, materials[found.rows], found.shapes, found.planes, depths,
        np.empty((len(depths), 3)) if finer is None else finer,
    )  # fmt: skip

    def emitted(cursor: NDArray[np.int64], count: int) -> WordArrays:
        fine = np.empty((count if exact else 0, 3), np.int32)
        out = WordArrays(cursor, np.empty(count, np.uint64), np.empty(count, np.uint32), fine)
        emit(size, stride, exact, table, given, out)
        return out

    counts = emitted(np.zeros(-(-width // stride) * height, np.int64), 0).cursor
    starts = np.concatenate([[0], np.cumsum(counts)])
    if (total := int(starts[-1])) > MOST_WORDS:
        raise InputError(
            f"one picture would need {total:,} code words, which is too many",
            hint="Move the camera away, or draw smaller splats with radius_scale",
        )
    out = emitted(starts[:-1].copy(), total)
    return EmittedWords(starts, out.words, out.ids, out.fine if exact else None)


def _depths(
    planes: NDArray[np.float64], near: float, far: float, perspective: bool, exact: bool
) -> tuple[NDArray[np.int32], NDArray[np.float64] | None]:
    """Z of elements, (M,), and finer depths, (M, 3) where outlines are exact: at their corners, and how much
    these grow a pixel right and down; of discs that are steeper than words hold, all of it as the centre."""
    start, end = (1 / near, 1 / far) if perspective else (near, far)
    span = (end - start) or 1.0
    centers = (planes[:, 0] - start) / span
    z = np.rint(np.clip(centers, 0, 1) * (DEPTHS - 1)).astype(np.int32)
    if not exact:
        return z, None
    finer = (planes[:, 1:4] - [start, 0, 0]) * (FINE_DEPTHS / span)
    steep = (np.abs(finer[:, 1:]) > STEEPEST_DEPTHS).any(axis=1)
    finer[steep] = 0
    finer[steep, 0] = centers[steep] * FINE_DEPTHS
    return z, finer
