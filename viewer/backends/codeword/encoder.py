"""Encoding on the GPU: points of a view become code words of the table, line by line.

The steps of project_kernels.py and emit_kernels.py in viewer/codewords/, in float32 up to whole numbers: what
lies between two of them may be rounded to the other one. What follows of these is to the bit. Words of a line
are in no order: at a pixel there is one of each point at most, so that points' rows tell them apart.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...codewords.encode import MOST_WORDS, Light
from ...codewords.stream import check_picture_size, strip_width
from ...codewords.tables import Steps, shape_table
from ...codewords.words import DEPTHS
from ...errors import InputError
from ...gpu import gl
from ...gpu.bindings import Storage, Texture
from ...gpu.blocks import Vec4
from ...gpu.compact import prefix_sums
from ...gpu.constants import LEAST_RADIUS, NOTHING
from ...gpu.context import Gpu
from ...scan.code_words import Params
from ...splatting.amplify import Points
from ...view import View
from .engine import Sheet, WordBuffers

MOST_TURNS = 1 << 15  # of loops in an invocation, about
_ROW_TURNS = 40  # of the loops about a row of words
_LINES, _WIDTH = 4, 8  # of a tile's word
_SIGN = 1 << 31
_SPREAD = struct.Struct("3I")


@dataclass(frozen=True)
class _Encoding:
    """How points become elements, and these words.

    radius_scale, uniform_radius, least_radius, cull_back: of surfels/splat.glsl. light: towards it, view
    space, and its shininess. sizes, half_count, table_reach: of the table. is_inverse: whether Z counts
    inverse depths.
    """

    radius_scale: float
    uniform_radius: float
    least_radius: float
    cull_back: bool
    size_parts: int
    normal_parts: int
    steepest: int
    sizes: int
    half_count: int
    table_reach: int
    picture_size: tuple[int, int]
    stride: int
    is_inverse: bool
    is_lit: bool
    from_eye: bool
    light: Vec4

    @property
    def steps(self) -> Steps:
        """The steps of the table."""
        return Steps(self.sizes, self.size_parts, 2 * self.steepest + 1, self.normal_parts)


@dataclass(frozen=True)
class ElementSpread:
    """Ranges of elements. near, far: the least and the largest depth, 1 where there are none.
    largest: size, in steps."""

    near: float
    far: float
    largest: int

    @classmethod
    def read(cls, gpu: Gpu, buffer: moderngl.Buffer) -> ElementSpread:
        """The spread that codeword/project.comp found; waits for the GPU. See codeword/element.glsl."""
        least, most, largest = _SPREAD.unpack(gpu.read(buffer, count=_SPREAD.size).tobytes())
        if least > most:
            return cls(1.0, 1.0, 0)
        bits = [word ^ _SIGN if word & _SIGN else ~word & 0xFFFF_FFFF for word in (least, most)]
        near, far = struct.unpack("2f", struct.pack("2I", *bits))
        return cls(near, far, largest)


class _Table:
    """A table of shapes as texels."""

    def __init__(self, gpu: Gpu, steps: Steps) -> None:
        table = shape_table(steps)
        rows = table.rows if len(table.rows) else np.zeros(1, np.uint16)
        self.shapes, self.rows = (
            gl.BufferTexture(gpu.buffer(np.ascontiguousarray(each, np.uint32)), gl.R32UI)
            for each in (table.entries, rows)
        )

    def bind(self) -> None:
        """Bind where shaders fetch from it."""
        self.shapes.bind(Texture.SHAPES)
        self.rows.bind(Texture.SHAPE_ROWS)


def encode_points(
    points: Points,
    view: View,
    words: WordBuffers,
    params: Params,
    light: Light,
    uniform_radius: float,
    materials: NDArray[np.uint8] | None = None,
) -> Sheet:
    """Fill `words` with those of the table; ranks are rows of the points' pose.

    uniform_radius: of points without one of their own, scan units. materials: of each row, None: all are of
    the first one. Raises InputError where there are too many words.
    """
    gpu = words.gpu
    check_picture_size(view.size)
    given = _encoding(view, params, light, uniform_radius)
    with gpu.timers.measure("project"):
        _project(points, words, given, materials)
    spread = ElementSpread.read(gpu, words.reserve("spread", _SPREAD.size).buffer)
    lines = -(-view.size[0] // given.stride) * view.size[1]
    with gpu.timers.measure("count"):
        starts = words.reserve("starts", 4 * (lines + 1)).buffer
        gpu.clear(starts, 0)
        _emit(points, words, given, spread, 0, starts)
        prefix_sums(gpu, starts, lines + 1)
    line_starts = gpu.read(starts, np.uint32, lines + 1)
    if (total := int(line_starts[-1])) > MOST_WORDS or 8 * total > gpu.max_storage_bytes:
        raise InputError(
            f"one picture would need {total:,} code words, which is too many",
            hint="Move the camera away, or draw smaller splats with radius_scale",
        )
    with gpu.timers.measure("encode"):
        cursors = words.reserve("cursors", 4 * lines).buffer
        gpu.ctx.copy_buffer(cursors, starts, 4 * lines)
        words.reserve("words", 8 * total)
        words.reserve("ranks", 4 * total)
        _emit(points, words, given, spread, 1, cursors)
    return Sheet(
        view.size, given.stride, spread.near, spread.far, view.perspective, False,
        line_starts.astype(np.int64), len(points.pose.cloud), has_owners=False,
    )  # fmt: skip


def _encoding(view: View, params: Params, light: Light, uniform_radius: float) -> _Encoding:
    steps = params.steps
    return _Encoding(
        radius_scale=params.radius_scale,
        uniform_radius=uniform_radius,
        least_radius=LEAST_RADIUS,
        cull_back=params.cull_back,
        size_parts=steps.size_parts,
        normal_parts=steps.normal_parts,
        steepest=steps.steepest,
        sizes=steps.sizes,
        half_count=steps.half_count,
        table_reach=shape_table(steps).reach,
        picture_size=view.size,
        stride=strip_width(view.size[0]),
        is_inverse=view.perspective,
        is_lit=light.is_lit,
        from_eye=light.direction is None,
        light=(*(light.direction or (0.0, 0.0, 1.0)), light.shininess),
    )


def _slices(size: tuple[int, int], radius: int) -> int:
    """How many invocations are to share the words of an element of so many pixels' radius."""
    width, height = (min(edge, 2 * radius) for edge in size)
    turns = -(-height // _LINES) * (-(-width // _WIDTH) + -(-size[0] // strip_width(size[0])) + _ROW_TURNS)
    return -(-turns // MOST_TURNS)


def _project(
    points: Points, words: WordBuffers, given: _Encoding, materials: NDArray[np.uint8] | None
) -> None:
    """Make elements of points, and find the range of their depths."""
    gpu = words.gpu
    elements = words.reserve("elements", 16 * points.count).buffer
    heads = words.reserve("heads", 4 * len(points.pose.cloud)).buffer
    spread = words.reserve("spread", _SPREAD.size).buffer
    spread.write(_SPREAD.pack(NOTHING, 0, 0))
    if materials is not None:
        words.write("point_materials", materials.astype(np.uint32))
        words.bind("point_materials")
    defines = {**points.defines, "MATERIALS": int(materials is not None)}
    program = gpu.compute("codeword/project.comp", defines, params=given)
    points.bind(program)
    elements.bind_to_storage_buffer(Storage.ELEMENTS)
    heads.bind_to_storage_buffer(Storage.HEADS)
    spread.bind_to_storage_buffer(Storage.SPREAD)
    gpu.dispatch(program, points.count)


def _emit(
    points: Points,
    words: WordBuffers,
    given: _Encoding,
    spread: ElementSpread,
    number: int,
    cursors: moderngl.Buffer,
) -> None:
    """Count words, or write them. number: of the pass."""
    gpu = words.gpu
    slices = _slices(given.picture_size, spread.largest // given.size_parts + 1)
    defines = {
        "PASS": number,
        "BEYOND": int(spread.largest >= given.sizes),
        "MOST_DEPTH": f"{DEPTHS - 1}.0",
        "SAMPLED": int(points.rows is not None),
    }
    program = gpu.compute("codeword/words.comp", defines, params=given)
    words.bind("elements")
    gpu.cached(_Table, given.steps).bind()
    cursors.bind_to_storage_buffer(Storage.CURSORS)
    if number == 1:
        words.bind("heads")
        if points.rows is not None:
            points.rows.bind(Texture.DRAWN_ROWS)
        words.reserve("words", 0).buffer.bind_to_storage_buffer(Storage.LINE_WORDS)
        words.reserve("ranks", 0).buffer.bind_to_storage_buffer(Storage.RANKS)
        gpu.set(program, nearest=spread.near, farthest=spread.far)
    gpu.set(program, slices=slices)
    gpu.dispatch(program, points.count * slices)
