"""Pyramidal projection: samples as they were measured, and holes that coarser levels close."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from range_scenes import heights, looking_at, shape_view, straight_above
from scenes import NOTHING, rarely
from scipy.ndimage import maximum_filter, minimum_filter
from scipy.spatial import ConvexHull, cKDTree

from viewer.bench.rounding import Rounding
from viewer.camera import Camera
from viewer.picture.surface import Surface
from viewer.scan.range_view import RangeView

pytestmark = pytest.mark.backend("pyramidal")
Draw = Callable[..., Surface]
Params = dict[str, Any]
# Samples of range views where they were measured, and nothing else.
BARE: Params = {"primitive": "points", "lod": False, "fill": False, "hide": False, "blend": "nearest"}


# --- samples as they were measured ----------------------------------------------------


def placed(view: RangeView, surface: Surface) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Depths (N,) and pixel coordinates (N, 2) in which all samples of a view lie in a picture: the plain
    version of `sample_place`, `to_screen_view` and `to_pixel` of the shaders, operation by operation in
    float32. NaN: no sample."""
    f = np.float32
    shown = surface.view
    to_view = np.eye(4)
    to_view[:3, :3] = shown.rotation
    to_view[:3, 3] = shown.translation - shown.rotation @ surface.pose.origin
    m = (to_view @ np.linalg.inv(view.world_to_camera)).astype(f)
    height, width = view.depth.shape
    v, u = np.indices((height, width)).reshape(2, -1).astype(f)
    depth = np.where(view.valid(), view.depth, f(np.nan)).ravel()
    with np.errstate(invalid="ignore"):
        if view.xy is not None:
            x, y = view.xy.reshape(-1, 2).T
        else:
            x, y = (u + f(0.5) - f(view.cx)) / f(view.fx), -((v + f(0.5) - f(view.cy)) / f(view.fy))
        z = depth
        if view.kind == "range":
            z = depth / np.sqrt(f(1) + x * x + y * y)
        if view.kind != "height" and view.xy is None:
            x, y = x * z, y * z
        x, y, z = (((m[i, 0] * x + m[i, 1] * y) + m[i, 2] * -z) + m[i, 3] for i in range(3))
        scale = f(shown.scale) / -z if shown.perspective else f(shown.scale)
        column, row = x * scale + f(0.5 * shown.size[0]), -y * scale + f(0.5 * shown.size[1])
    return -z, np.stack([column, row], axis=1)


def nearest_samples(
    views: tuple[RangeView, ...], surface: Surface
) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """The depth of the nearest sample in each pixel and the first that has it, sample by sample."""
    shown = surface.view
    depths, pixels = (np.concatenate(each) for each in zip(*(placed(v, surface) for v in views), strict=True))
    assert depths.dtype == pixels.dtype == np.float32
    with np.errstate(invalid="ignore"):
        there = (depths >= shown.near) & (depths <= shown.far)
        there &= ((pixels >= 0) & (pixels < shown.size)).all(axis=1)
    depth = np.full(shown.size[::-1], np.inf, np.float32)
    number = np.full(shown.size[::-1], NOTHING, np.uint32)
    for i in np.flatnonzero(there):
        x, y = pixels[i].astype(int)
        if depths[i] < depth[y, x]:
            depth[y, x], number[y, x] = depths[i], i
    return depth, number


def rounding_of_places(views: tuple[RangeView, ...], surface: Surface) -> float:
    """How far from where `placed` has it a sample may lie, scan units: along either axis of a pod's picture a
    quotient, of ranges a root and another quotient, and three roundings, each of a number no larger than what
    is added up."""
    shown, extents = surface.view, []
    for view in views:
        pod = np.linalg.inv(view.world_to_camera)[:3, 3] - surface.pose.origin
        aside = float(np.linalg.norm(shown.rotation @ pod + shown.translation))
        extents.append(aside + 2 * float(view.depth[view.valid()].max()))
    return (3 * Rounding.of(surface.gpu).quotient + 3) * 2.0**-23 * max(extents)


def near_edges(views: tuple[RangeView, ...], surface: Surface, error: float) -> NDArray[np.bool_]:
    """Pixels, (H, W), of samples that lie in another one where they are off by `error`, scan units."""
    shown, quotient = surface.view, Rounding.of(surface.gpu).quotient * 2.0**-23
    edges = np.zeros(shown.size[::-1], bool)
    for view in views:
        depths, pixels = placed(view, surface)
        there = (depths > shown.near) & ((pixels > -1) & (pixels < np.add(shown.size, 1))).all(axis=1)
        depth, at = depths[there, None].astype(np.float64), pixels[there].astype(np.float64)
        aside = np.abs(at - shown.center)
        slack = (
            quotient * aside + error * (shown.scale + aside) / depth
            if shown.perspective
            else error * shown.scale
        )
        for sign in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            other = np.floor(at + slack * np.array(sign)).astype(int)
            beside = (other != np.floor(at)).any(axis=1)
            for x, y in np.concatenate([other[beside], np.floor(at[beside]).astype(int)]):
                if 0 <= x < shown.size[0] and 0 <= y < shown.size[1]:
                    edges[y, x] = True
    return edges


CAMERAS = {
    "perspective": Camera((3.5, 1.2, 3.0), (0.5, 0.0, 0.0), fov_y=40),
    "orthographic": Camera((3.5, 1.2, 3.0), (0.5, 0.0, 0.0), projection="orthographic", height=3.0),
    "inside": Camera((1.4, 0.3, 1.1), (-1.0, 0.1, -0.4), fov_y=100),
}


def two_pods(kind: str, measured: bool = False) -> tuple[RangeView, RangeView]:
    """A sphere and a plane behind it, as two pods see them, with holes."""
    first, second = (shape_view(name, kind, measured=measured)[0] for name in ("sphere", "plane"))
    second = replace(second, world_to_camera=looking_at((2.0, 1.5, 3.0), (0.5, 0.0, 0.0)))
    rng = np.random.default_rng(3)
    return replace(first, mask=rng.random(first.depth.shape) < 0.9), second


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
@pytest.mark.parametrize(
    ("kind", "measured"), [("z", False), ("z", True), ("range", False), ("height", False)]
)
def test_pixels_show_the_very_samples(draw: Draw, kind: str, measured: bool, camera: Camera) -> None:
    """Depth bit for bit, number, and no nearer one in the pixel; on hardware but for last bits."""
    views = two_pods(kind, measured)
    surface = draw(views, camera, (160, 120), "pyramidal", params=BARE)
    depth, number = nearest_samples(views, surface)
    assert (number != NOTHING).mean() > 0.1
    seen, there = surface.id != NOTHING, number != NOTHING
    np.testing.assert_array_equal(surface.level, np.where(seen, 0, 255))
    if surface.gpu.software:
        np.testing.assert_array_equal(surface.id, number)
        np.testing.assert_array_equal(surface.depth[there], depth[there])
        return
    error = rounding_of_places(views, surface)
    clear = ~near_edges(views, surface, error)
    assert clear.mean() > 0.9
    np.testing.assert_array_equal(seen[clear], there[clear])
    np.testing.assert_allclose(surface.depth[clear & there], depth[clear & there], rtol=0, atol=error)
    assert (surface.id != number)[clear].mean() < 1e-3, "those as near but for that"


# --- holes ----------------------------------------------------------------------------

HOLE, PERIOD = 8, 49  # pixels; 49 is 1 more than cells of the coarsest level are wide
OPEN = np.ones((16 * PERIOD + PERIOD - HOLE,) * 2, bool)
for row in range(16):  # 16 x 16 of them, each at another place in its cell
    for column in range(16):
        y, x = PERIOD * (row + 1) - HOLE, PERIOD * (column + 1) - HOLE
        OPEN[y : y + HOLE, x : x + HOLE] = False
every_primitive = pytest.mark.parametrize("primitive", ["points", "polygons"])
every_upsampling = pytest.mark.parametrize("upsampling", ["nearest", "bilinear", "bicubic"])


def seen_from_above(draw: Draw, view: RangeView, zoom: float = 1.0, **params: object) -> Surface:
    camera, size = straight_above(view.depth.shape, zoom)
    return draw((view,), camera, size, "pyramidal", params=params)


@every_upsampling
@every_primitive
def test_a_hole_of_8_pixels_closes_wherever_it_is(draw: Draw, primitive: str, upsampling: str) -> None:
    """Farooq 2013, 4.1.2, with five levels."""
    flat = heights(np.full(OPEN.shape, -500), OPEN, color=np.full((*OPEN.shape, 3), (200, 100, 50), np.uint8))
    surface = seen_from_above(draw, flat, primitive=primitive, upsampling=upsampling)
    np.testing.assert_allclose(surface.depth, 500, rtol=5e-7)
    np.testing.assert_array_equal(surface.id != NOTHING, OPEN)
    assert not surface.level[OPEN].any()
    assert 1 <= surface.level[~OPEN].min() <= surface.level[~OPEN].max() <= 3
    assert (surface.image() == (200, 100, 50, 255)).all()


@every_upsampling
@every_primitive
def test_filled_pixels_are_between_their_neighbours(draw: Draw, primitive: str, upsampling: str) -> None:
    """On a slope: off by less than two cells of the level that fills, and between what these have."""
    y, x = np.mgrid[: OPEN.shape[0], : OPEN.shape[1]]
    shades = np.stack([x // 4, y // 4, x * 0], axis=2).astype(np.uint8)
    slope = heights(0.5 * x + 0.25 * y - 700, OPEN, color=shades)
    surface = seen_from_above(draw, slope, primitive=primitive, upsampling=upsampling)
    away = np.abs(surface.depth - (1000 + slope.depth))
    assert not away[OPEN].any()
    cell = 2.0**surface.level
    assert (away[~OPEN] <= 0.75 * cell[~OPEN]).all()
    for level in np.unique(surface.level[~OPEN]):
        reach, here = 6 * 2 ** int(level), ~OPEN & (surface.level == level)  # the kernel's, of up to 5 cells
        for found, given in ((surface.depth, 1000 + slope.depth), *zip(bytes_of(surface), bytes_of(slope))):  # noqa: B905
            low = minimum_filter(np.where(OPEN, given, np.inf), reach)
            high = maximum_filter(np.where(OPEN, given, -np.inf), reach)
            assert (low[here] <= found[here] + 1e-4).all()
            assert (found[here] <= high[here] + 1e-4).all()


def bytes_of(shown: Surface | RangeView) -> NDArray[np.uint8]:
    """Colours, (3, H, W)."""
    rgb = shown.image()[..., :3] if isinstance(shown, Surface) else shown.color
    return np.moveaxis(rgb, 2, 0)  # type: ignore[arg-type]


@every_primitive
@pytest.mark.slow
def test_holes_stay_open_without_the_levels_that_close_them(draw: Draw, primitive: str) -> None:
    flat = heights(np.full(OPEN.shape, -500), OPEN)
    fine = seen_from_above(draw, flat, primitive=primitive, level_3=False, level_4=False)
    part = np.isinf(fine.depth[~OPEN]).mean()
    assert 0.5 < part < 0.9
    assert set(np.unique(fine.level)) == {0, 1, 255}
    alone = seen_from_above(draw, flat, primitive=primitive, level_3=False)
    assert np.isfinite(alone.depth).all(), "a coarser level does instead"
    assert set(np.unique(alone.level)) == {0, 1, 4}
    none = seen_from_above(draw, flat, primitive=primitive, fill=False)
    np.testing.assert_array_equal(np.isfinite(none.depth), OPEN)


@every_upsampling
@every_primitive
@pytest.mark.parametrize("beside", [*rarely(0), 40], ids=["cut off", "whole"])
def test_gaps_and_outlines_stay(draw: Draw, primitive: str, upsampling: str, beside: int) -> None:
    """A slot of 8 pixels through an object, wherever it is; and not a pixel is added around it."""
    for at in range(16):
        mask = np.zeros((120, 160), bool)
        mask[beside : 120 - beside, beside : 160 - beside] = True
        mask[:, 70 + at : 78 + at] = False
        view = heights(np.full(mask.shape, -500), mask)
        surface = seen_from_above(draw, view, primitive=primitive, upsampling=upsampling)
        np.testing.assert_array_equal(np.isfinite(surface.depth), mask)


def wave(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """An outline with bays, eight samples deep and sixteen from one to the next."""
    return 4 * np.sin(0.4 * x) + x / 4


def test_points_do_not_spill_into_bays(draw: Draw) -> None:
    """Samples four pixels apart, cut off by the picture's frame; distances to the true outline in pixels."""
    y, x = np.mgrid[:96, :96] - 47.5
    view = heights(np.full(x.shape, -500), y > wave(x))
    camera, size = straight_above((64, 64), 4.0)
    surface = draw((view,), camera, size, "pyramidal", params={"primitive": "points"})
    row, column = (np.mgrid[: size[1], : size[0]] + 0.5) / 4 - 32
    along = np.linspace(-40, 40, 8001)
    outline = cKDTree(np.stack([along, wave(along)], axis=1))
    beyond = 4 * outline.query(np.stack([column, row], axis=2))[0] * np.where(row > wave(column), -1, 1)
    drawn = np.isfinite(surface.depth)
    assert np.quantile(beyond[drawn & (beyond > 0)], 0.95) <= 2
    assert drawn[beyond < -4].all(), "no holes but along the outline"


def beside_slit(row: NDArray[np.float64], column: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far a place lies from an oblique slit that narrows to a point, in samples; below 0 within it."""
    return (abs(column + 0.3 * row) - (row + 40) / 5) / np.hypot(1, 1 / 5)


@pytest.mark.parametrize("step", [0, 8])
def test_points_do_not_close_a_slit_between_two_parts(draw: Draw, step: int) -> None:
    """Samples four pixels apart, of two sheets so many samples behind one another; distances in pixels."""
    y, x = np.mgrid[:96, :96] - 47.5
    view = heights(np.where(x + 0.3 * y < 0, -500, -500 - step), beside_slit(y, x) > 0)
    camera, size = straight_above((64, 64), 4.0)
    surface = draw((view,), camera, size, "pyramidal", params={"primitive": "points"})
    beside = 4 * beside_slit(*((np.mgrid[: size[1], : size[0]] + 0.5) / 4 - 32))
    drawn = np.isfinite(surface.depth)
    assert np.quantile(-beside[drawn & (beside < 0)], 0.95) <= 2
    assert drawn[beside > 4].all(), "no holes but along the slit"


y, x = np.mgrid[:64, :64] - 31.5
OUTLINES = {
    "square": (np.maximum(abs(x), abs(y)) < 20, 0.0),
    "diamond": (abs(x) + abs(y) < 24, 0.0),
    "disk": (np.hypot(x, y) < 24, 1.25),
}


@pytest.mark.parametrize("zoom", [1.0, 1.3, 2.5, 6.0])
@pytest.mark.parametrize(("inside", "corner"), OUTLINES.values(), ids=OUTLINES)
def test_nothing_is_filled_beyond_the_margin(
    draw: Draw, inside: NDArray[np.bool_], corner: float, zoom: float
) -> None:
    """Distances outwards from straight outlines, in samples; round ones grow more, between eight sides."""
    hull = ConvexHull(np.stack([x[inside], y[inside]], axis=1))
    view = heights(np.full(inside.shape, -500), inside)
    for margin in (0.0, 0.15, 0.6):
        surface = seen_from_above(draw, view, zoom, primitive="points", margin=margin)
        for filled, spread in ((surface.row == NOTHING, margin + corner), (surface.row != NOTHING, 0.71)):
            row, column = np.nonzero(np.isfinite(surface.depth) & filled)
            places = (np.stack([column, row], axis=1) + 0.5 - np.array(surface.size) / 2) / zoom
            beyond = (places @ hull.equations[:, :2].T + hull.equations[:, 2]).max(axis=1, initial=-np.inf)
            assert beyond.max(initial=0) <= spread + 1e-3
