"""Samples of range views on the GPU, against numpy."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray
from range_scenes import LENSES, looking_at, shape_view, sphere_view

from viewer.bounds import Bounds
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.errors import InputError
from viewer.gpu import gl, range_samples
from viewer.gpu.bindings import UniformBlock
from viewer.gpu.blocks import BlockBuffer
from viewer.gpu.constants import RANGE_TILE, RANGE_TILE_TEXELS, STEEPEST
from viewer.gpu.context import Gpu
from viewer.gpu.pose import GpuPose
from viewer.gpu.pyramid import BINOMIAL, BOX, GAUSSIAN, NEAREST, TENT, Filter
from viewer.gpu.range_samples import RangeSamples
from viewer.gpu.view import ViewBlock
from viewer.scan.colors import linear_from_srgb8, srgb8
from viewer.scan.pose import Pose
from viewer.scan.range_view import DepthKind, RangeView
from viewer.srgb import bytes_from_linear, linear_from_bytes
from viewer.view import View

PROBE = str(Path(__file__).resolve().parent / "shaders" / "range_probe.comp")
FILTERS = {"box": BOX, "nearest": NEAREST, "tent": TENT, "binomial": BINOMIAL, "gaussian": GAUSSIAN}
SIZES = [(1, 1), (1, 9), (6, 1), (7, 5), (16, 16), (33, 18)]
VIEWS = (sphere_view((0, 0, 4), size=(47, 39)), sphere_view((2, 0, 4), size=(20, 30), name="right"))


# --- what the GPU holds ---------------------------------------------------------------


@dataclass
class Image:
    """One level of a view: depth (H, W), look (H, W, 4) uint8, xy (H, W, 2) or None."""

    depth: NDArray[np.float32]
    look: NDArray[np.uint8]
    xy: NDArray[np.float32] | None


def held(gpu: Gpu, views: tuple[RangeView, ...], **options: object) -> RangeSamples:
    """The samples of views, complete."""
    gpu.activate()
    samples = RangeSamples(gpu, views, **options)
    assert samples.upload(np.inf)
    return samples


def read(samples: RangeSamples) -> list[list[Image]]:
    """All levels of all views."""

    def texels(buffer: gl.BufferTexture, dtype: type, channels: int) -> NDArray:
        return np.frombuffer(buffer.buffer.read(), dtype).reshape(-1, channels)

    depths, looks = texels(samples.depths, np.float32, 1)[:, 0], texels(samples.looks, np.uint8, 4)
    xy = None if samples.xy is None else texels(samples.xy, np.float32, 2)

    def image(level: range_samples.SampleLevel) -> Image:
        part, shape = slice(level.first, level.first + level.count), level.size[::-1]
        own = None if xy is None else xy[part].reshape(*shape, 2)
        return Image(depths[part].reshape(shape), looks[part].reshape(*shape, 4), own)

    return [[image(level) for level in levels] for levels in samples.view_levels]


def read_tiles(samples: RangeSamples) -> list[NDArray[np.float32]]:
    """The tiles of all levels of all views, (N, 4 RANGE_TILE_TEXELS) each."""
    texels = np.frombuffer(samples.tiles.buffer.read(), np.float32).reshape(-1, 4 * RANGE_TILE_TEXELS)
    places = [level for levels in samples.view_levels for level in levels]
    return [texels[level.first_tile :][: level.tiles] for level in places]


def assert_same(samples: RangeSamples, others: RangeSamples) -> None:
    """Depths, looks and tiles of all levels are the same bits."""
    for own, other in zip(read_tiles(samples), read_tiles(others), strict=True):
        assert own.tobytes() == other.tobytes()
    for own, other in zip(read(samples), read(others), strict=True):
        for a, b in zip(own, other, strict=True):
            assert a.depth.tobytes() == b.depth.tobytes()
            assert a.look.tobytes() == b.look.tobytes()


# --- the plain versions ---------------------------------------------------------------


def spacing(view: RangeView, level: int, depth: float) -> float:
    across = 2**level / min(view.fx, view.fy)
    return across if view.kind == "height" else across * depth


def reduced(view: RangeView, fine: Image, level: int, how: Filter) -> Image:
    """A level of the one before, of this number: sample by sample."""
    height, width = fine.depth.shape
    shape = (-(-height // 2), -(-width // 2))
    xy = None if fine.xy is None else np.zeros((*shape, 2), np.float32)
    coarse = Image(np.zeros(shape, np.float32), np.zeros((*shape, 4), np.uint8), xy)
    for row, column in np.ndindex(*shape):
        reach = [
            (float(down * right), y, x)
            for y, down in enumerate(how.taps, 2 * row + how.first)
            for x, right in enumerate(how.taps, 2 * column + how.first)
            if 0 <= y < height and 0 <= x < width
        ]
        there = [(tap, y, x) for tap, y, x in reach if fine.look[y, x, 3]]
        if not there:
            continue
        inside, present = (
            sum(tap for tap, _, _ in reach),
            sum(tap * fine.look[y, x, 3] for tap, y, x in there),
        )
        coarse.look[row, column, 3] = max(1, np.floor(present / inside + 0.5))
        _, y, x = min(there, key=lambda each: fine.depth[each[1:]])
        near = float(fine.depth[y, x])
        if how.nearest:
            coarse.depth[row, column], coarse.look[row, column, :3] = near, fine.look[y, x, :3]
            if xy is not None:
                xy[row, column] = fine.xy[y, x]
            continue
        limit = STEEPEST * spacing(view, level, near)
        same = [(tap * fine.look[y, x, 3], y, x) for tap, y, x in there if fine.depth[y, x] - near <= limit]
        weights = np.array([weight for weight, _, _ in same]) / sum(weight for weight, _, _ in same)
        pixels = tuple(np.array([(y, x) for _, y, x in same]).T)
        coarse.depth[row, column] = weights @ fine.depth[pixels].astype(float)
        linear = linear_from_bytes(fine.look[pixels][:, :3])
        coarse.look[row, column, :3] = bytes_from_linear(weights @ linear)
        if xy is not None:
            xy[row, column] = weights @ fine.xy[pixels].astype(float)
    return coarse


def assert_levels(view: RangeView, levels: list[Image], how: Filter) -> None:
    """Each level is what the plain version makes of the one before. Places are those of a view that has them:
    of another beside it, nobody wrote any."""
    if view.xy is None:
        levels = [replace(level, xy=None) for level in levels]
    for number, (fine, coarse) in enumerate(pairwise(levels)):
        expected = reduced(view, fine, number, how)
        np.testing.assert_allclose(coarse.depth, expected.depth, rtol=1e-6, atol=1e-6)
        off = np.abs(coarse.look.astype(int) - expected.look)
        assert off.max() <= (0 if how.nearest else 1), "rounding of powers and of sums"
        if how in (BOX, NEAREST):
            assert not off[..., 3].any()
        np.testing.assert_array_equal(coarse.look[..., 3] > 0, expected.look[..., 3] > 0)
        if coarse.xy is not None:
            np.testing.assert_allclose(coarse.xy, expected.xy, rtol=1e-5, atol=1e-5)


def stepped_view(
    size: tuple[int, int], kind: DepthKind = "z", measured: bool = False, seed: int = 0
) -> RangeView:
    """Two surfaces with an outline between them, a slope, holes, and depths that are none."""
    rng = np.random.default_rng(seed)
    shape = size[::-1]
    y, x = np.mgrid[: shape[0], : shape[1]]
    front = (x - 0.6 * size[0]) ** 2 + (y - 0.4 * size[1]) ** 2 < (0.3 * max(size)) ** 2
    depth = np.where(front, 2.0, 3.0 + 0.01 * x) + 0.01 * rng.random(shape) - (5 if kind == "height" else 0)
    depth[rng.random(shape) < 0.1] = np.nan
    depth[rng.random(shape) < 0.05] = np.inf
    if kind != "height":
        depth[rng.random(shape) < 0.05] = -1
    xy = np.stack([x, -y], axis=2) / 40 + rng.normal(0, 0.002, (*shape, 2))
    return RangeView(
        depth=depth.astype(np.float32),
        kind=kind,
        mask=rng.random(shape) < 0.8,
        color=rng.integers(0, 256, (*shape, 3), np.uint8),
        confidence=rng.random(shape, np.float32),
        xy=xy.astype(np.float32) if measured else None,
        fx=40.0,
        fy=44.0,
        cx=size[0] / 2,
        cy=size[1] / 2,
        world_to_camera=np.eye(4),
    )


def test_the_spacing_of_samples_is_that_of_the_farthest_views(renderer: Renderer) -> None:
    """Of a map of heights, that of its cells; of a camera, where nine tenths of the depths are nearer."""
    heights, camera = stepped_view((33, 18), "height"), stepped_view((33, 18))
    for depth in (5.0, 0.5):
        flat = replace(camera, depth=np.full_like(camera.depth, depth))
        samples = held(renderer.gpu, (heights, flat))
        assert samples.spacing == pytest.approx(max(1 / 40, depth / 40))
        samples.release()


# --- level 0 and the pyramid ----------------------------------------------------------


@pytest.mark.parametrize("view", [*VIEWS, stepped_view((33, 18)), stepped_view((7, 5), "height", True)])
def test_level_0_is_what_was_read(renderer: Renderer, view: RangeView) -> None:
    samples = held(renderer.gpu, (view,))
    level = read(samples)[0][0]
    assert level.depth.tobytes() == view.depth.tobytes(), "NaN and all"
    np.testing.assert_array_equal(level.look[..., :3], srgb8(view.color))
    part = view.confidence / view.confidence.max()
    np.testing.assert_allclose(level.look[..., 3], np.where(view.valid(), 1 + 254 * part, 0), atol=0.51)
    np.testing.assert_array_equal(level.look[..., 3] > 0, view.valid())
    assert (level.xy is None) == (view.xy is None)
    if view.xy is not None:
        np.testing.assert_array_equal(level.xy, view.xy)
    samples.release()


def test_what_a_view_lacks_is_full(renderer: Renderer) -> None:
    bare = replace(VIEWS[0], color=None, confidence=None)
    unknown = replace(bare, confidence=np.full(bare.depth.shape, np.nan, np.float32))
    for view in (bare, unknown):
        level = read(held(renderer.gpu, (view,)))[0][0]
        expected = np.where(view.valid(), 255, 0)
        np.testing.assert_array_equal(level.look[..., 3], expected)
        assert (level.look[..., :3] == 255).all()
    partly = replace(
        bare, confidence=np.where(np.arange(47) % 2, np.float32(np.nan), np.float32(-3)) + bare.depth * 0
    )
    partly.confidence[:, 3] = 8
    alpha = read(held(renderer.gpu, (partly,)))[0][0].look[..., 3]
    np.testing.assert_array_equal(
        alpha[view.valid()], np.where(np.arange(47) == 3, 255, 1)[np.nonzero(view.valid())[1]]
    )


def test_linear_colors_become_what_they_were_made_of(renderer: Renderer) -> None:
    stored = np.arange(256 * 3, dtype=np.uint8).reshape(16, 16, 3)
    view = replace(stepped_view((16, 16)), color=linear_from_srgb8(stored))
    np.testing.assert_array_equal(read(held(renderer.gpu, (view,)))[0][0].look[..., :3], stored)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", FILTERS)
def test_pyramids_are_those_of_numpy(renderer: Renderer, name: str, size: tuple[int, int]) -> None:
    views = tuple(
        stepped_view(size, kind, measured, seed)
        for seed, (kind, measured) in enumerate(
            [("z", False), ("range", False), ("height", False), ("height", True)]
        )
    )
    for some in (views[:1], views):  # without measured x and y, and with
        samples = held(renderer.gpu, some, how=FILTERS[name])
        for view, levels in zip(some, read(samples), strict=True):
            assert len(levels) == samples.levels
            assert_levels(view, levels, FILTERS[name])
        samples.release()


def test_nothing_bleeds_in_from_what_is_no_sample(renderer: Renderer) -> None:
    """What invalid samples have makes no difference."""
    view = stepped_view((33, 18))
    none = ~view.valid()
    other = replace(
        view,
        depth=np.where(none, np.float32(1e-3), view.depth),
        color=np.where(none[..., None], np.uint8(255), view.color),
        mask=~none,
    )
    for how in FILTERS.values():
        first, second = (read(held(renderer.gpu, (each,), how=how))[0][1:] for each in (view, other))
        for a, b in zip(first, second, strict=True):
            np.testing.assert_array_equal(a.depth, b.depth)
            np.testing.assert_array_equal(a.look, b.look)


def test_depths_of_two_surfaces_are_not_mixed(renderer: Renderer) -> None:
    view = stepped_view((33, 18))
    front = view.valid() & (view.depth < 2.5)
    view = replace(view, depth=np.where(front, np.float32(2), np.float32(99)), mask=view.valid())
    for how in FILTERS.values():
        for level in read(held(renderer.gpu, (view,), how=how))[0]:
            assert np.isin(level.depth[level.look[..., 3] > 0], [2, 99]).all(), "neither more nor less"


def test_another_filter_is_that_from_the_beginning(renderer: Renderer) -> None:
    samples = held(renderer.gpu, VIEWS)
    for name in ("gaussian", "nearest", "box"):
        samples.reduce(FILTERS[name])
        anew = held(renderer.gpu, VIEWS, how=FILTERS[name])
        assert_same(samples, anew)
        anew.release()


def test_a_filter_that_is_there_costs_nothing(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    samples = held(renderer.gpu, VIEWS)
    monkeypatch.setattr(Gpu, "dispatch", lambda *_: pytest.fail("made anew"))
    samples.reduce(BOX)


# --- places ---------------------------------------------------------------------------


def seen_by(
    view: RangeView, projection: str = "perspective", size: tuple[int, int] = (160, 120), **orbit: float
) -> View:
    """A view of a picture on what a range view sees."""
    places = view.positions()
    bounds = Bounds(places.min(axis=0), places.max(axis=0))
    camera = Camera.orbit(bounds, projection=projection, aspect=size[0] / size[1], **orbit)
    return View.of(camera, size, np.zeros(3), bounds)


def probe(
    samples: RangeSamples, view: View, number: int, level: int, tiles: bool = False, **uniforms: float
) -> NDArray:
    """What range_probe.comp finds of each sample, (H, W, 5, 4), or of each tile, (N, 2, 4)."""
    gpu, place = samples._gpu, samples.view_levels[number][level]
    block = BlockBuffer(gpu.ctx, ViewBlock, UniformBlock.VIEW)
    block.write(ViewBlock.of(view))
    block.bind()
    samples.bind(view)
    count, texels = (place.tiles, 2) if tiles else (place.count, 5)
    program = gpu.compute(PROBE, {**samples.defines, "PROBE_TILES": int(tiles)})
    found = gpu.ctx.buffer(reserve=16 * texels * count)
    found.bind_to_storage_buffer(0)
    gpu.set(program, number=number, level=level, view_count=len(samples.view_levels), target=number)
    gpu.set(program, **uniforms)
    gpu.dispatch(program, count)
    out = np.frombuffer(found.read(), np.float32).reshape(-1, texels, 4)
    gpu.discard(block, found)
    return out if tiles else out.reshape(*place.size[::-1], texels, 4)


SHAPES: list[tuple[str, DepthKind, str, bool]] = [
    *((shape, kind, "none", False) for shape in ("sphere", "plane") for kind in get_args(DepthKind)),
    *((shape, kind, "none", True) for shape in ("sphere", "plane") for kind in ("z", "height")),
    *(("plane", kind, lens, False) for lens in LENSES if lens != "none" for kind in ("z", "range")),
]


@pytest.mark.parametrize(("shape", "kind", "lens", "measured"), SHAPES)
def test_places_are_those_of_the_view(
    renderer: Renderer, shape: str, kind: DepthKind, lens: str, measured: bool
) -> None:
    """In the picture's space, among others; and back to pixels and depths."""
    own, _, _ = shape_view(shape, kind, lens, measured)
    views = (VIEWS[0], own, stepped_view((7, 5)))
    samples, view = held(renderer.gpu, views), seen_by(own, azimuth=20, elevation=-10)
    found, valid = probe(samples, view, 1, 0), own.valid()
    np.testing.assert_array_equal(found[..., 0, 3] > 0, valid)
    expected = own.positions() @ view.rotation.T + view.translation
    reach = np.abs(expected).max()
    np.testing.assert_allclose(found[valid][:, 1, :3], expected, atol=4e-6 * reach)
    pixels, depths = own.project(own.positions())
    if measured:
        row, column = np.nonzero(valid)
        pixels = np.stack([column + 0.5, row + 0.5], axis=1)
    else:
        np.testing.assert_allclose(found[valid][:, 3, :2], pixels, atol=2e-3)
    np.testing.assert_allclose(found[valid][:, 3, 2], depths, rtol=2e-6, atol=2e-6 * reach)
    samples.release()


@pytest.mark.parametrize(
    ("lens", "half", "steps"), [("kinect", 0.2, 2), ("kinect", 0.8, 5), ("rational", 0.65, 5)]
)
def test_a_lens_is_undone_to_float32_however_wide(
    renderer: Renderer, lens: str, half: float, steps: int
) -> None:
    """By as many steps as it takes."""
    depth = np.full((81, 81), 2.0, np.float32)
    focal = 40.5 / half
    lens_view = replace(
        stepped_view((81, 81)),
        depth=depth,
        mask=depth > 0,
        fx=focal,
        fy=focal,
        cx=40.5,
        cy=40.5,
        distortion=LENSES[lens],
    )
    samples = held(renderer.gpu, (lens_view,))
    assert samples.defines["RANGE_LENS_STEPS"] == steps
    found = probe(samples, seen_by(lens_view), 0, 0)[..., 0, :3].reshape(-1, 3)
    np.testing.assert_allclose(found, lens_view.positions(), atol=1e-6)
    samples.release()


@pytest.mark.parametrize("level", range(6))
@pytest.mark.parametrize("how", [BOX, GAUSSIAN])
def test_coarse_samples_lie_where_stated(renderer: Renderer, level: int, how: Filter) -> None:
    """A leaning plane stays one in each level, where all of a sample's reach is inside."""
    own, _, _ = shape_view("plane", "height")
    samples = held(renderer.gpu, (own,), how=how)
    found = probe(samples, seen_by(own), 0, level)
    inner = found[2:-3, 2:-3, 0, :3].reshape(-1, 3)
    np.testing.assert_allclose(inner @ [0.36, 0.48, 0.8], -3, atol=1e-5)
    columns = np.arange(found.shape[1])
    place = (columns + 0.5) * 2**level if how == BOX else columns * 2**level + 0.5
    np.testing.assert_array_equal(found[0, :, 2, 3], place)
    np.testing.assert_array_equal(found[:, 0, 3, 3], np.arange(len(found)))
    samples.release()


def test_numbers_of_samples_are_decoded(renderer: Renderer) -> None:
    views = (*VIEWS, stepped_view((1, 1)), stepped_view((33, 18)))
    samples = held(renderer.gpu, views)
    before = 0
    for number, levels in enumerate(samples.view_levels):
        for level, place in enumerate(levels):
            found = probe(samples, seen_by(VIEWS[0]), number, level)
            assert (found[..., 4, :2] == 1).all()
            index = place.first + np.arange(place.count).reshape(place.size[::-1])
            np.testing.assert_array_equal(found[..., 4, 3], index)
            row, column = np.indices(index.shape) // RANGE_TILE
            np.testing.assert_array_equal(found[..., 4, 2], row * -(-place.size[0] // RANGE_TILE) + column)
        ids = probe(samples, seen_by(VIEWS[0]), number, 0)[..., 1, 3]
        np.testing.assert_array_equal(ids.ravel(), before + np.arange(ids.size))
        before += ids.size
    assert before == samples.count


@pytest.mark.parametrize(("shape", "kind", "lens", "measured"), SHAPES)
def test_normals_are_those_of_the_shape(
    renderer: Renderer, shape: str, kind: DepthKind, lens: str, measured: bool
) -> None:
    own, _, normals = shape_view(shape, kind, lens, measured)
    samples, view = held(renderer.gpu, (own,)), seen_by(own)
    found = probe(samples, view, 0, 0)[own.valid()][:, 2, :3]
    known = np.linalg.norm(found, axis=1) > 0
    assert known.mean() > 0.995
    np.testing.assert_allclose(np.linalg.norm(found[known], axis=1), 1, atol=1e-5)
    cosine = (found * (normals @ view.rotation.T)).sum(axis=1)[known]
    assert np.quantile(cosine, 0.1) > np.cos(np.radians(3)), "but for the outline"
    assert np.median(cosine) > np.cos(np.radians(0.5))
    samples.release()


def test_a_sample_alone_has_no_normal(renderer: Renderer) -> None:
    view = stepped_view((5, 4), "height")
    alone = np.zeros((4, 5), bool)
    alone[1, 1] = alone[3, 3:] = True
    found = probe(
        held(renderer.gpu, (replace(view, depth=np.ones((4, 5), np.float32), mask=alone),)),
        seen_by(VIEWS[0]),
        0,
        0,
    )
    assert (found[alone][:, 2, :3] == 0).all()
    assert np.isfinite(found[..., 2, :3]).all()


@pytest.mark.parametrize("kind", get_args(DepthKind))
def test_places_project_to_other_views_as_they_do_in_numpy(renderer: Renderer, kind: DepthKind) -> None:
    """Where a pod does not see it is NaN: behind it, and where its lens has folded the picture over."""
    one = sphere_view((0, 0, 4))
    aside = looking_at((1.5, 0.4, 1.2), (0.2, 0, 0)), looking_at((0, 0, 0.9), (0, 1, 2))
    others = [replace(one, world_to_camera=matrix, kind=kind) for matrix in aside]
    if kind != "height":
        others += [replace(other, distortion=(-0.3, 0.0, 0.01, 0.0)) for other in others]
    samples, view, none = held(renderer.gpu, (one, *others)), seen_by(one), 0
    for number, other in enumerate(others, 1):
        found = probe(samples, view, 0, 0, target=number)[one.valid()][:, 3]
        pixels, depths = other.project(one.positions())
        near = np.isfinite(pixels[:, 0]) & (np.abs(pixels).max(axis=1) < 500)
        np.testing.assert_allclose(found[near, :2], pixels[near], atol=0.01)
        np.testing.assert_allclose(found[near, 2], depths[near], atol=1e-5)
        np.testing.assert_array_equal(np.isnan(found[:, 0]), np.isnan(pixels[:, 0]))
        none += np.isnan(pixels[:, 0]).sum()
    assert (none > 100) == (kind != "height")
    samples.release()


@pytest.mark.parametrize("kind", ["z", "height"])
def test_places_project_to_samples_of_a_measured_grid(renderer: Renderer, kind: DepthKind) -> None:
    own, _, _ = shape_view("sphere", kind, measured=True)
    row, column = np.indices(own.depth.shape)
    holes = replace(own, mask=(row // 9 + column // 9) % 2 == 0)
    samples = held(renderer.gpu, (own, holes))
    for number, (view, least) in enumerate([(own, 0.97), (holes, 0.75)]):
        found = probe(samples, seen_by(own), 0, 0, target=number)[..., 3, :]
        there = np.isfinite(found[..., 0])
        assert there[view.valid()].mean() > least, "but for some at edges, which the calibration misses"
        assert not (there & ~view.valid()).any()
        pixels = np.stack([column, row], axis=2)[there] + 0.5
        assert np.quantile(np.abs(found[there][:, :2] - pixels), 0.99) < 1e-3
        np.testing.assert_allclose(found[there][:, :2], pixels, atol=0.2)
    samples.release()


# --- tiles ----------------------------------------------------------------------------


def tiles_of(level: range_samples.SampleLevel) -> NDArray[np.int64]:
    """The number of each sample's tile, (H, W)."""
    row, column = np.indices(level.size[::-1]) // RANGE_TILE
    return row * -(-level.size[0] // RANGE_TILE) + column


def some_views(rng: np.random.Generator, center: NDArray, radius: float, count: int) -> list[View]:
    """Pictures of what is about a place: from afar and from within, some from behind."""
    views = []
    for number in range(count):
        eye = center + rng.normal(size=3) * radius * rng.choice([0.5, 2, 5])
        target = center + rng.normal(size=3) * radius * 0.7
        camera = Camera(
            eye=tuple(eye),
            target=tuple(target),
            projection=("perspective", "orthographic")[number % 2],
            fov_y=float(rng.choice([5, 40, 100])),
            height=float(radius * rng.choice([0.1, 1, 3])),
            near=float(radius * rng.choice([0.01, 1])),
            far=float(radius * rng.choice([2, 20])),
        )
        bounds = Bounds(center - radius, center + radius)
        views.append(View.of(camera, (160, 120), np.zeros(3), bounds))
    return views


@pytest.mark.parametrize(("shape", "kind", "lens", "measured"), SHAPES)
def test_no_tile_is_left_out_that_shows_something(
    renderer: Renderer, shape: str, kind: DepthKind, lens: str, measured: bool
) -> None:
    """Neither samples in the picture nor such as face the eye are in tiles that are told to be outside or to
    face away; and there are many of these."""
    own, _, _ = shape_view(shape, kind, lens, measured)
    rng = np.random.default_rng(3)
    holes = rng.random(own.depth.shape) < 0.02
    holes[:32, :48] = True  # some tiles are empty
    own = replace(own, mask=own.mask & ~holes)
    samples, places = held(renderer.gpu, (own,)), own.positions()
    counts = {"outside": 0, "invisible": 0, "away": 0, "all away": 0, "empty": 0, "tiles": 0}
    for view in some_views(rng, np.median(places, axis=0), 2.0, 24):
        for level in (0, 1, 3):
            place, number = samples.view_levels[0][level], tiles_of(samples.view_levels[0][level])
            found, margin = probe(samples, view, 0, level), float(rng.choice([0, 5]))
            there = found[..., 0, 3] > 0
            tiles = probe(samples, view, 0, level, tiles=True, margin=margin)
            empty, outside, away = (tiles[:, 0, :3] > 0).T

            def any_of(which: NDArray, number: NDArray = number, count: int = place.tiles) -> NDArray:
                return np.bincount(number[which], minlength=count) > 0

            np.testing.assert_array_equal(empty & any_of(there), False)
            at = found[..., 1, :3].astype(float)
            depth = -at[..., 2]
            scale = view.scale / depth if view.perspective else np.full_like(depth, view.scale)
            pixel = np.abs(at[..., :2] * scale[..., None])
            in_picture = (pixel <= np.array(view.size) / 2 + margin).all(axis=2)
            visible = there & in_picture & (depth >= view.near) & (depth <= view.far)
            assert not (outside & any_of(visible)).any()
            normal = found[..., 2, :3]
            sight = at if view.perspective else np.array([0, 0, -1.0])
            faces = there & ((normal * sight).sum(axis=2) <= 0)
            assert not (away & any_of(faces)).any()
            counts["outside"] += outside[~empty].sum()
            counts["invisible"] += (any_of(there) & ~any_of(visible)).sum()
            counts["away"] += away[~empty].sum()
            counts["all away"] += (any_of(there) & ~any_of(faces)).sum()
            counts["empty"] += empty.sum()
            counts["tiles"] += place.tiles
    assert counts["outside"] > 0.8 * counts["invisible"] > 0.1 * counts["tiles"]
    assert counts["away"] > 0.4 * counts["all away"] > 0.05 * counts["tiles"]
    assert counts["empty"] > 0
    samples.release()


def test_pixels_between_samples_are_within_what_is_told(renderer: Renderer) -> None:
    own, _, _ = shape_view("sphere", "z")
    samples = held(renderer.gpu, (own,))
    for view in some_views(np.random.default_rng(4), np.median(own.positions(), axis=0), 2.0, 12):
        for level in (0, 2):
            number, found = tiles_of(samples.view_levels[0][level]), probe(samples, view, 0, level)
            told = probe(samples, view, 0, level, tiles=True)[:, 1].astype(float)
            at, there = found[..., 1, :3].astype(float), found[..., 0, 3] > 0
            depth = -at[..., 2]
            seen = there & (depth >= view.near) & (np.abs(at[..., 0]) < depth) & (np.abs(at[..., 1]) < depth)
            both = seen[:, 1:] & seen[:, :-1]
            apart = np.linalg.norm(at[:, 1:] - at[:, :-1], axis=2)
            spacing = told[number[:, :-1], 2:]
            same = both & (apart <= spacing[..., 1] * 1.001)
            assert same.sum() > 0.95 * both.sum()
            assert (apart[same] >= spacing[same, 0] * 0.999).all()
            scale = view.scale / depth if view.perspective else np.full_like(depth, view.scale)
            pixel = at[..., :2] * scale[..., None]
            inside = same & (np.abs(pixel) <= np.array(view.size) / 2).all(axis=2)[:, :-1]
            pixels = np.linalg.norm(pixel[:, 1:] - pixel[:, :-1], axis=2)
            assert (pixels[inside] <= told[number[:, :-1][inside], 1] * 1.001).all()
            least = apart * np.minimum(scale[:, 1:], scale[:, :-1])
            assert (least[inside] >= told[number[:, :-1][inside], 0] * 0.999).all()
    samples.release()


# --- as it is uploaded ----------------------------------------------------------------


def test_a_pose_brings_its_samples(renderer: Renderer) -> None:
    pose = GpuPose(renderer.gpu, Pose.of(0, 0.0, "x", VIEWS))
    assert pose.names_of(("views",)) == ["samples"]
    assert pose.uploaded_bytes == 0
    samples = pose.samples
    assert pose.samples is samples
    assert samples.complete
    assert pose.uploaded_bytes == samples.nbytes
    assert not pose.pose.is_merged
    assert pose.upload(["samples"])
    np.testing.assert_array_equal(read(samples)[1][0].depth, VIEWS[1].depth)


def test_samples_come_in_slices(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = held(renderer.gpu, VIEWS)
    monkeypatch.setattr(range_samples, "_SLICE", 5 * 47 + 3)  # rows at a time: 5 of one view, 11 of the other
    pose = GpuPose(renderer.gpu, Pose.of(0, 0.0, "x", VIEWS))
    calls = 1
    while not pose.upload(["samples"], budget_ms=0):
        calls += 1
        assert pose.uploaded_bytes == 0
    assert calls > 8 + 3 + 2 * 5
    assert_same(pose.samples, whole)


def test_samples_go_with_the_pose(renderer: Renderer) -> None:
    own, pose = Renderer(renderer.gpu, budget_bytes=1), Pose.of(0, 0.0, "x", VIEWS)
    samples = own.resident(pose).samples
    assert own.nbytes == samples.nbytes
    own.resident(replace(pose, index=1))
    assert own.nbytes == 0
    own.gpu.collect()
    assert type(samples.depths.buffer.mglo).__name__ == "InvalidObject", "released"
    own.release()


def test_a_pose_without_range_views_has_no_samples(renderer: Renderer) -> None:
    pose = GpuPose(renderer.gpu, Pose(0, 0.0, "x", Pose.of(0, 0.0, "x", VIEWS).cloud))
    with pytest.raises(InputError, match="no range views"):
        _ = pose.samples


def test_levels_and_bytes(renderer: Renderer) -> None:
    samples = held(renderer.gpu, VIEWS)
    assert samples.levels == 6
    assert [level.size for level in samples.view_levels[0]] == [
        (47, 39),
        (24, 20),
        (12, 10),
        (6, 5),
        (3, 3),
        (2, 2),
    ]
    assert held(renderer.gpu, (stepped_view((7, 5)),)).levels == 4
    assert held(renderer.gpu, VIEWS, levels=2).levels == 2
    large = held(renderer.gpu, (stepped_view((400, 300)),))
    assert large.count == 120_000
    assert large.bytes_per_sample == large.nbytes / large.count < 8 * 4 / 3 + 0.5
    assert all(level.first % 64 == 0 for levels in samples.view_levels for level in levels)


def test_far_from_the_world_s_zero_nothing_is_lost(renderer: Renderer) -> None:
    view, far = seen_by(VIEWS[0]), np.array([512_345.0, 5_400_123.0, 80.0])
    matrix = VIEWS[0].world_to_camera.copy()
    matrix[:3, 3] -= matrix[:3, :3] @ far
    near, moved = held(renderer.gpu, VIEWS[:1]), replace(VIEWS[0], world_to_camera=matrix)
    expected = probe(near, view, 0, 0)[VIEWS[0].valid()]
    samples = RangeSamples(renderer.gpu, (moved,))
    samples.upload(np.inf)
    np.testing.assert_allclose(
        probe(samples, replace(view, origin=far), 0, 0)[moved.valid()][:, :4], expected[:, :4], atol=1e-5
    )


def test_too_many_samples_are_told(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(renderer.gpu, "max_points", 600)
    with pytest.raises(InputError, match="the range views of one pose have 2,433 pixels, which is too many"):
        held(renderer.gpu, VIEWS)
    with pytest.raises(ValueError, match="at most 8"):
        held(renderer.gpu, VIEWS, levels=9)


@pytest.mark.slow
def test_two_views_of_3000x4500_are_held(renderer: Renderer, capsys: pytest.CaptureFixture[str]) -> None:
    """27 million samples: a buffer is larger than what shaders may write of one at a time."""
    y, x = np.mgrid[-1.5:1.5:4500j, -1:1:3000j].astype(np.float32)
    inside = x * x + y * y < 0.9
    depth = np.where(inside, 3 - np.sqrt(np.where(inside, 1 - x * x - y * y, 1)), np.float32(np.nan))
    color = np.random.default_rng(2).integers(0, 256, (4500, 3000, 3), np.uint8)
    view = RangeView(
        depth=depth,
        mask=np.ones(depth.shape, bool),
        color=color,
        fx=3600.0,
        fy=3600.0,
        cx=1500.0,
        cy=2250.0,
        world_to_camera=np.eye(4),
    )
    gpu = renderer.gpu
    held(gpu, VIEWS[:1]).release()  # programs are built
    start = time.perf_counter()
    samples = RangeSamples(gpu, (view, view))
    slices = []
    while not samples.complete:
        before = time.perf_counter()
        samples.upload(0)
        slices.append(time.perf_counter() - before)
    gpu.ctx.finish()
    seconds = time.perf_counter() - start
    with capsys.disabled():
        print(
            f"\n{samples.count / 1e6:.0f} M samples in {seconds:.2f} s, "
            f"slices up to {max(slices) * 1e3:.0f} ms, {samples.bytes_per_sample:.2f} bytes a sample"
        )
    if gpu.software:
        assert samples.depths.buffer.size > gpu.max_storage_bytes
    assert samples.bytes_per_sample < 8 * 4 / 3 + 0.3
    levels = read(samples)[1]
    assert levels[0].depth.tobytes() == depth.tobytes()
    for number, (fine, coarse) in enumerate(pairwise(levels)):
        middle = fine.depth.shape[0] // 4 * 2
        left, width = fine.depth.shape[1] // 16 * 2, min(64, fine.depth.shape[1] // 8 * 2)

        def part(level: Image, rows: slice, columns: slice) -> Image:
            return Image(level.depth[rows, columns], level.look[rows, columns], None)

        crop = part(fine, slice(middle, middle + 40), slice(left, left + width))
        expected = reduced(view, crop, number, BOX)
        height, width = expected.depth.shape
        found = part(coarse, slice(middle // 2, middle // 2 + height), slice(left // 2, left // 2 + width))
        np.testing.assert_allclose(found.depth, expected.depth, rtol=1e-6)
        assert np.abs(found.look.astype(int) - expected.look).max() <= 1
    tiles = read_tiles(samples)[samples.levels]  # of level 0 of the second view
    nearest = np.fmin.reduceat(
        np.fmin.reduceat(depth, range(0, 4500, 16), axis=0), range(0, 3000, 16), axis=1
    )
    nearest = np.where(np.isnan(nearest), np.inf, nearest).ravel()
    assert (tiles[:, 2] <= nearest).all()
    np.testing.assert_allclose(tiles[np.isfinite(nearest), 2], nearest[np.isfinite(nearest)], rtol=2e-3)
    samples.release()
    gpu.collect()
