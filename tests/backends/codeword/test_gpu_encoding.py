"""Encoding on the GPU beside that of the CPU: elements to a step, what follows of these to the bit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.backends import backend
from viewer.backends.codeword import encoder
from viewer.backends.codeword.engine import WordBuffers
from viewer.bench.scenes.samples import on_torus
from viewer.camera import PROJECTIONS, Camera
from viewer.codewords.encode import Encoding, Projected, emit_words, project_elements
from viewer.codewords.engine import draw_words
from viewer.codewords.outline_kernels import PLANE_COLUMNS
from viewer.codewords.project_kernels import (
    DIFFUSE,
    NORMAL_I,
    SHAPE_COLUMNS,
    SIZE,
    SPECULAR,
    X,
    Y,
)
from viewer.codewords.stream import strip_width
from viewer.codewords.words import decode_words
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request, view_of
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.code_words import elements_of, point_materials, word_lights, words_of
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

LOOK = Look(quality="fast", color_by="height")
COUNT = 6000


@dataclass(frozen=True, eq=False)
class Encoded:
    """What the GPU made of a request: elements, and words in lines by row and place."""

    found: Projected
    line_starts: NDArray[np.uint32]
    words: NDArray[np.uint64]
    ranks: NDArray[np.uint32]


def encoded(renderer: Renderer, request: Request, size: tuple[int, int]) -> Encoded:
    surface = Surface(renderer.gpu, size)
    render_frame(renderer, request, surface)
    buffers, count = surface.cached(WordBuffers), len(request.pose.cloud)

    def read(name: str, kind: Any, length: int) -> NDArray:
        texels = buffers.reserve(name, 0)
        return np.frombuffer(texels.buffer.read(), kind)[:length].copy()

    lines = -(-size[0] // strip_width(size[0])) * size[1]
    starts = read("starts", np.uint32, lines + 1)
    words, ranks = read("words", np.uint64, starts[-1]), read("ranks", np.uint32, starts[-1])
    order = in_order(starts, words, ranks)
    packed, heads = read("elements", np.uint32, 4 * count).reshape(-1, 4), read("heads", np.uint32, count)
    spread = encoder.ElementSpread.read(renderer.gpu, buffers.reserve("spread", 0).buffer)
    rows = np.flatnonzero(packed[:, 2]).astype(np.uint32)
    packed, heads = packed[rows], heads[rows]
    shapes = np.empty((len(rows), SHAPE_COLUMNS), np.int32)
    shapes[:, [X, Y]] = (packed[:, :2] & 0xFFFFFF).astype(np.int32) - (1 << 23)
    shapes[:, [NORMAL_I, NORMAL_I + 1]] = (packed[:, :2] >> 24).astype(np.int32) - 128
    shapes[:, SIZE] = packed[:, 2]
    shapes[:, DIFFUSE], shapes[:, SPECULAR] = heads & 127, heads >> 7 & 127
    planes = np.zeros((len(rows), PLANE_COLUMNS))
    planes[:, 0] = packed[:, 3].copy().view(np.float32)  # depth
    return Encoded(
        Projected(rows, shapes, planes, spread.near, spread.far), starts, words[order], ranks[order]
    )


def in_order(starts: NDArray, words: NDArray, ids: NDArray) -> NDArray[np.intp]:
    """The order of words by line, row and their own number."""
    return np.lexsort([words, ids, np.repeat(np.arange(len(starts) - 1), np.diff(starts.astype(np.int64)))])


def scene(kind: str, projection: str, size: tuple[int, int]) -> tuple[Pose, Camera]:
    rng = np.random.default_rng(7)
    if kind == "torus":
        cloud = PointCloud.from_arrays(**on_torus(COUNT))
    else:
        arrays = {
            "positions": rng.uniform(-1, 1, (COUNT, 3)),
            "normals": rng.normal(size=(COUNT, 3)),
            "radii": 0.002 * 10.0 ** rng.uniform(0, 2.3, COUNT),  # up to hundreds of pixels
        }
        if kind == "ellipses":
            arrays["axes"] = rng.normal(size=(COUNT, 4)) * arrays["radii"][:, None]
            arrays["axes"][:, 3] = np.abs(arrays["axes"][:, 3])
        cloud = PointCloud.from_arrays(**arrays)
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=size[0] / size[1], projection=projection)
    return Pose.of(0, 0.0, "", cloud), camera


SCENES = [
    (kind, projection, size)
    for kind, size in (
        ("torus", (320, 240)),
        ("discs", (1100, 90)),
        ("ellipses", (90, 300)),
        ("discs", (9, 7)),
    )
    for projection in PROJECTIONS
]


@pytest.mark.parametrize(("kind", "projection", "size"), SCENES)
@pytest.mark.parametrize(
    "settings", [{}, {"cull_back": True, "radius_scale": 0.5, "size_parts": 5, "normals": 21}]
)
def test_elements_are_within_a_step(
    renderer: Renderer, kind: str, projection: str, size: tuple[int, int], settings: dict[str, object]
) -> None:
    """Each field; and few differ at all, those that lie between two steps."""
    pose, camera = scene(kind, projection, size)
    params = backend("codeword").params({"lighting": "own", **settings})
    request = Request(pose, camera, "codeword", params, LOOK)
    here = encoded(renderer, request, size).found
    view, light = view_of(request, size), word_lights(LOOK, True)
    elements = elements_of(pose, view, params, np.zeros(COUNT, np.uint8))
    there = project_elements(
        elements, view, light, Encoding(params.steps, False, params.radius_scale, params.cull_back)
    )
    rows, mine, theirs = np.intersect1d(here.rows, there.rows, return_indices=True)
    assert len(rows) >= 0.998 * max(len(here.rows), len(there.rows)) > 0  # others are at an edge
    one, other = here.shapes[mine].astype(int), there.shapes[theirs].astype(int)
    normals = slice(NORMAL_I, NORMAL_I + 2)
    turned = (np.abs(one + other) < np.abs(one - other))[:, normals].any(axis=1)  # the same shape
    one[turned, normals] *= -1
    apart = np.abs(one - other)
    relative = apart[:, SIZE] <= np.maximum(1, 1e-5 * other[:, SIZE])
    assert relative.all()
    apart[:, SIZE] = apart[:, SIZE].clip(max=1)
    assert apart.max() <= 1
    assert apart.any(axis=1).mean() <= 0.005
    depths = there.planes[theirs, 0]
    np.testing.assert_allclose(
        here.planes[mine, 0], 1 / depths if view.perspective else depths, atol=1e-5 * (there.far - there.near)
    )


@pytest.mark.parametrize(("kind", "projection", "size"), SCENES)
@pytest.mark.parametrize("settings", [{}, {"sizes": 5, "size_parts": 3, "normals": 31, "normal_parts": 3}])
@pytest.mark.parametrize("turns", [encoder.MOST_TURNS, 200])
def test_words_of_elements_are_the_cpus(
    renderer: Renderer,
    monkeypatch: pytest.MonkeyPatch,
    kind: str,
    projection: str,
    size: tuple[int, int],
    settings: dict[str, object],
    turns: int,
) -> None:
    """To the bit: these are whole numbers; also where several invocations share an element."""
    monkeypatch.setattr(encoder, "MOST_TURNS", turns)
    pose, camera = scene(kind, projection, size)
    params = backend("codeword").params({"lighting": "own", **settings})
    request = Request(pose, camera, "codeword", params, LOOK)
    here = encoded(renderer, request, size)
    depths = np.zeros(COUNT, np.int32)
    depths[here.ranks] = decode_words(here.words)["z"]  # one of each element
    _, materials = point_materials(pose, view_of(request, size), LOOK)
    starts, words, ids, _ = emit_words(here.found, materials, size, params.steps, depths[here.found.rows])
    order = in_order(starts, words, ids)
    np.testing.assert_array_equal(here.line_starts, starts)
    np.testing.assert_array_equal(here.ranks, ids[order])
    np.testing.assert_array_equal(here.words, words[order])


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_depths_are_within_a_step(renderer: Renderer, projection: str) -> None:
    size = (320, 240)
    pose, camera = scene("torus", projection, size)
    params = backend("codeword").params({"lighting": "own"})
    request = Request(pose, camera, "codeword", params, LOOK)
    here, there = encoded(renderer, request, size), words_of(pose, view_of(request, size), LOOK, params)
    z = np.full((2, COUNT), -1)
    z[0, here.ranks] = decode_words(here.words)["z"]
    z[1, there.ids] = decode_words(there.words)["z"]
    both = z[:, (z >= 0).all(axis=0)]
    assert both.shape[1] > 0.9 * COUNT
    assert (np.ptp(both, axis=0) <= 1).all()
    assert np.ptp(both, axis=0).mean() <= 0.005
    assert both.min() == 0
    assert both.max() == 511


def test_nothing_in_sight(renderer: Renderer) -> None:
    pose, camera = scene("torus", "perspective", (50, 40))
    away = Camera(eye=camera.eye, target=tuple(2 * np.array(camera.eye) - np.array(camera.target)))
    surface = Surface(renderer.gpu, (50, 40))
    render_frame(renderer, Request(pose, away, "codeword"), surface)
    assert not surface.coverage.any()


@pytest.mark.parametrize("radius", [400.0, 1200.0, 5000.0, 30_000.0])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.6, -0.4), (-1.0, 2.0)])
def test_a_huge_disc_ends_where_the_cpus_does(
    renderer: Renderer, radius: float, tilt: tuple[float, float]
) -> None:
    """To a pixel of each row where 32 bits do not decide, and to the bit where they do: its leftmost part."""
    size = (150, 100)
    width = radius * np.sqrt((1 + tilt[1] ** 2) / (1 + tilt[0] ** 2 + tilt[1] ** 2))
    above = width * tilt[0] * tilt[1] / (1 + tilt[1] ** 2)  # of its leftmost point
    cloud = PointCloud.from_arrays(
        positions=np.array([[width - 20.0, 3.0 - above, 0.0]]),
        normals=np.array([[*tilt, 1.0]]),
        radii=np.array([radius]),
    )
    pose = Pose.of(0, 0.0, "", cloud)
    camera = Camera(
        eye=(0, 0, 100), target=(0, 0, 0), near=1, far=1000, projection="orthographic", height=100.0
    )
    params = backend("codeword").params({"lighting": "own"})
    request, surface = Request(pose, camera, "codeword", params, LOOK), Surface(renderer.gpu, size)
    render_frame(renderer, request, surface)
    covered = draw_words(words_of(pose, view_of(request, size), LOOK, params)).covered
    assert 0 < covered.sum() < covered.size
    other = covered != (surface.coverage > 0)
    assert other.sum(axis=1).max() <= (0 if radius < 1400 else 1)
