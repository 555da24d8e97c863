"""Elements and streams for tests of code words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from itertools import pairwise
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray

from viewer.bounds import Bounds
from viewer.camera import Camera
from viewer.codewords.encode import Elements
from viewer.codewords.lighting import Materials
from viewer.codewords.stream import FINE_DEPTHS, WordStream
from viewer.codewords.words import FIELDS, decode_scans, decode_words
from viewer.view import View

GREY = Materials.of_palette(np.array([[200, 190, 180], [90, 120, 150]], np.uint8), 0.2, 0.7, 0.3)


def encode_words(fields: Mapping[str, ArrayLike]) -> NDArray[np.uint64]:
    """Words of the values of all `FIELDS`, (N,) each, or one for all."""
    words = np.zeros((), np.uint64)
    for name, (at, bits) in FIELDS.items():
        values = np.asarray(fields[name])
        assert not values.size or 0 <= values.min() <= values.max() < 1 << bits, name
        words = words | values.astype(np.uint64) << np.uint64(at)
    return words


def encode_scans(spans: ArrayLike) -> NDArray[np.uint32]:
    """SCANS of four rows, (..., 4, 2): first and last column of each, 0 to 7."""
    rows = np.asarray(spans, np.uint32)
    fields = rows[..., 0] | rows[..., 1] << np.uint32(3)
    return (fields << np.arange(0, 24, 6, dtype=np.uint32)).sum(axis=-1, dtype=np.uint32)


def front_view(size: tuple[int, int], perspective: bool = False) -> View:
    """A view along -z from (0, 0, 100) of the plane z = 0, where a pixel is one unit, its middle at 0."""
    height = float(size[1])
    camera = Camera(
        eye=(0, 0, 100), target=(0, 0, 0), near=1, far=1000,
        projection="perspective" if perspective else "orthographic", height=height,
        fov_y=float(np.degrees(2 * np.arctan(height / 200))),
    )  # fmt: skip
    half = np.array([size[0] / 2, size[1] / 2, 50.0])
    return View.of(camera, size, np.zeros(3), Bounds(-half, half))


def scattered(count: int, size: tuple[int, int], seed: int, radius: float = 3.0) -> Elements:
    """Elements about a picture and beyond its edges, with all kinds of normals."""
    rng = np.random.default_rng(seed)
    positions = rng.uniform(-0.6, 0.6, (count, 3)) * [*size, 60]
    normals = rng.normal(size=(count, 3))
    radii = radius * rng.uniform(0.2, 3.0, count)
    return Elements(
        positions=positions.astype(np.float32),
        materials=(np.arange(count) % 2).astype(np.uint8),
        normals=normals.astype(np.float32),
        radii=radii.astype(np.float32),
    )


def one_element(position: tuple[float, float, float], radius: float, normal: Any = (0, 0, 1)) -> Elements:
    return Elements(
        positions=np.array([position], np.float32),
        materials=np.zeros(1, np.uint8),
        normals=np.array([normal], np.float32),
        radii=np.array([radius], np.float32),
    )


def drawn_pixels(stream: WordStream) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All pixels of all words: (F,) numbers of words, (F,) of pixels, and (F,) finer depths there."""
    lines = np.repeat(np.arange(len(stream.line_starts) - 1), np.diff(stream.line_starts))
    strips, tops = np.divmod(lines, stream.size[1])
    fields = decode_words(stream.words)
    spans = decode_scans(fields["scans"])
    below = np.where(fields["mode"][:, None, None] == 0, 7 - spans[:, ::-1, ::-1], [7, 0])
    spans = np.concatenate([spans, below], axis=1)
    columns = np.arange(8)
    word, row, column = np.nonzero((columns >= spans[..., :1]) & (columns <= spans[..., 1:]))
    x, y = fields["x"][word] + column, tops[word] + row
    inside = (x < stream.stride) & (x + strips[word] * stream.stride < stream.size[0]) & (y < stream.size[1])
    word, row, column, x, y = (each[inside] for each in (word, row, column, x, y))
    assert stream.finer is not None
    key, right, down = stream.finer[word].T.astype(np.int64)
    pixel = y * stream.size[0] + x + strips[word] * stream.stride
    return word, pixel, key + right * column + down * row


def equal_streams(a: WordStream, b: WordStream) -> bool:
    """Whether two streams have the same bits."""

    def is_same(x: object, y: object) -> bool:
        if isinstance(x, Materials):
            return all(is_same(getattr(x, f.name), getattr(y, f.name)) for f in fields(Materials))
        if isinstance(x, np.ndarray):
            return isinstance(y, np.ndarray) and x.dtype == y.dtype and np.array_equal(x, y)
        return x == y

    return all(is_same(getattr(a, f.name), getattr(b, f.name)) for f in fields(WordStream))


@st.composite
def streams(draw: st.DrawFn, finer: bool | None = None, sampled: bool = False) -> WordStream:
    """Streams of any words: ids that several have, depths that are equal, bitmaps beyond the edges."""
    samples = draw(st.sampled_from([1, 1, 2, 4])) if sampled else 1
    width, height = draw(st.tuples(st.integers(1, 30 // samples), st.integers(1, 20 // samples)))
    size = (samples * width, samples * height)
    stride = draw(st.integers(max(1, size[0] // 3), size[0]))
    strips = -(-size[0] // stride)
    lines = draw(st.lists(st.integers(0, strips * size[1] - 1), max_size=25))
    lines.sort()
    count = len(lines)
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    fields = {name: rng.integers(0, 1 << bits, count) for name, (_, bits) in FIELDS.items()}
    fields["z"] = rng.choice([0, 1, 255, 511], count)
    fields["material"] = rng.integers(0, len(GREY), count)
    left = np.array(lines, int) // size[1] * stride
    fields["x"] = rng.integers(0, np.minimum(stride, size[0] - left)) if count else np.zeros(0, int)
    ids = rng.integers(0, 12, count).astype(np.uint32)
    line_starts = np.searchsorted(lines, np.arange(strips * size[1] + 1))
    for start, end in pairwise(line_starts):
        ids[start:end].sort()
    has_finer = draw(st.booleans()) if finer is None else finer
    steps = rng.integers(-4, 5, (count, 3)) * [FINE_DEPTHS // 8, FINE_DEPTHS // 64, FINE_DEPTHS // 64]
    return WordStream(
        size=size, stride=stride, line_starts=line_starts.astype(np.int64), words=encode_words(fields),
        ids=ids, near=2.0, far=5.0, materials=GREY, background=(10, 20, 30, 255),
        perspective=draw(st.booleans()), finer=steps.astype(np.int32) if has_finer else None,
        depth_bits=draw(st.sampled_from([16, 24])) if has_finer else 24, samples=samples,
    )  # fmt: skip
