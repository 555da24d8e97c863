"""Pictures at rest are means of pictures whose cameras are shifted by less than a pixel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from range_scenes import sphere_view
from scenes import every_backend, of_variant, sphere

from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import draw_plan, render_frame, sample_shifts, supersample
from viewer.drawing.plan import make_plan
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.look import SAMPLES, Look
from viewer.picture.mean import PictureMean
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.srgb import LIGHT_PARTS, bytes_from_light, light_from_bytes

SIZE = (96, 64)
Shift = tuple[float, float]
PROJECTIONS = pytest.mark.parametrize("projection", ["perspective", "orthographic"])


def of_sphere(name: str, projection: str = "perspective", **look: object) -> Request:
    """A sphere by a variant of a backend, which range views have seen where points will not do."""
    name, setting = of_variant(name)
    pose = Pose(0, 0.0, "test", sphere(3000))
    if "views" in backend(name).needs(pose, backend(name).params(setting)):
        pose = Pose.of(0, 0.0, "test", tuple(sphere_view(eye) for eye in ((0, 0, 3), (3, 0, 0))))
    camera = Camera.orbit(pose.bounds, 20, 10, aspect=SIZE[0] / SIZE[1], projection=projection)
    return Request(pose, camera, name, backend(name).params(setting), Look(**look))


def drawn(renderer: Renderer, request: Request, shift: Shift = (0.0, 0.0)) -> Surface:
    """One sample of each pixel."""
    surface = Surface(renderer.gpu, SIZE)
    while draw_plan(make_plan(renderer, request, SIZE), surface, budget_ms=None, shift=shift):  # type: ignore[arg-type]
        pass
    return surface


def refined(renderer: Renderer, request: Request) -> Surface:
    """All samples."""
    surface = drawn(renderer, request)
    while supersample(renderer, request, surface):
        pass
    return surface


def mean_of(pictures: list[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """The mean of pictures (H, W, 4), as PictureMean says."""
    all_of = np.stack(pictures)
    alpha = all_of[..., 3:].astype(np.int64)
    light, cover = (light_from_bytes(all_of[..., :3]) * alpha).sum(axis=0), alpha.sum(axis=0)
    parts = (LIGHT_PARTS * light + cover // 2) // np.maximum(cover, 1)
    mean = np.floor(cover / len(pictures) + 0.5).astype(np.uint8)
    return np.where(cover > 0, np.dstack([bytes_from_light(parts / LIGHT_PARTS), mean]), pictures[0])


@pytest.mark.parametrize("samples", SAMPLES.values())
def test_samples_have_a_column_and_a_row_each_about_the_middle(samples: int) -> None:
    shifts = np.array(sample_shifts(samples))
    assert not shifts[0].any(), "the picture that is there already"
    lines = np.arange(samples) - samples // 2
    for axis in range(2):
        np.testing.assert_allclose(np.sort(shifts[:, axis]) * samples, lines, atol=1e-12)
    for first in range(1, samples + 1, 4):
        np.testing.assert_allclose(shifts[:first].mean(axis=0), 0, atol=1e-12)


@PROJECTIONS
@every_backend
def test_a_shift_moves_the_picture_by_so_many_pixels(renderer: Renderer, name: str, projection: str) -> None:
    request = of_sphere(name, projection)
    still, moved = drawn(renderer, request), drawn(renderer, request, (3.0, -2.0))
    expected, found = still.image()[2:, :-3], moved.image()[:-2, 3:]
    other = np.abs(expected.astype(int) - found).max(axis=2) > 8
    assert (still.coverage > 0).sum() > 1000
    assert other.mean() < 0.01
    half = drawn(renderer, request, (0.5, 0.5))
    assert (half.image() != still.image()).any()


@PROJECTIONS
@every_backend
def test_the_picture_is_the_mean_of_its_samples_and_all_else_stays(
    renderer: Renderer, name: str, projection: str
) -> None:
    request = of_sphere(name, projection, background="#20304080")
    one, surface = drawn(renderer, request), refined(renderer, request)
    samples = [drawn(renderer, request, shift).image() for shift in sample_shifts(5)]
    np.testing.assert_array_equal(surface.image(), mean_of(samples))
    assert (surface.image() != one.image()).any()
    assert surface.stats.samples == 5
    for channel, before in one.arrays().items():
        np.testing.assert_array_equal(surface.arrays()[channel], before, channel)


def test_samples_share_the_colours_of_the_middle_one(renderer: Renderer) -> None:
    request = of_sphere("surfels", color_by="depth")
    surface = refined(renderer, request)
    assert surface.color_range is not None
    low, high = surface.color_range
    told = replace(request, look=replace(request.look, low=low, high=high))
    samples = [drawn(renderer, told, shift).image() for shift in sample_shifts(5)]
    np.testing.assert_array_equal(surface.image(), mean_of(samples))


def test_a_picture_shows_four_more_samples_at_a_time(renderer: Renderer) -> None:
    request = of_sphere("points", quality="fine")
    surface = drawn(renderer, request)
    shown = []
    while supersample(renderer, request, surface):
        shown.append(surface.stats.samples)
    assert shown == [1, 1, 1, 5, 5, 5, 5, 9, 9, 9, 9, 13, 13, 13, 13]
    assert surface.stats.samples == 17
    assert not supersample(renderer, request, surface)


def test_samples_of_another_picture_begin_anew(renderer: Renderer) -> None:
    request = of_sphere("points")
    surface = refined(renderer, request)
    expected = surface.image()
    other = replace(request, camera=request.camera.orbited(30, 0))
    while render_frame(renderer, other, surface):
        pass
    supersample(renderer, other, surface)
    while render_frame(renderer, request, surface):
        pass
    while supersample(renderer, request, surface):
        pass
    np.testing.assert_array_equal(surface.image(), expected)
    fast = replace(request, look=replace(request.look, quality="fast"))
    while render_frame(renderer, fast, surface):
        pass
    assert not supersample(renderer, fast, surface)
    assert surface.stats.samples == 1


@PROJECTIONS
def test_edges_of_a_disc_come_near_to_what_it_covers(renderer: Renderer, projection: str) -> None:
    """One splat, seen from before it: of each pixel on its edge, a share is covered."""
    cloud = PointCloud.from_arrays(
        np.zeros((1, 3)), normals=np.array([[0.0, 0.0, 1.0]]), radii=np.array([1.0])
    )
    camera = Camera((0.013, 0.007, 10.0), (0.013, 0.007, 0.0), projection=projection, height=3.0, fov_y=17.0)
    request = Request(Pose(0, 0.0, "disc", cloud), camera, "surfels", look=Look(background="#00000000"))
    view = drawn(renderer, request).view
    fine = (np.arange(64) + 0.5) / 64
    x = np.add.outer(np.arange(SIZE[0]), fine).ravel()
    y = np.add.outer(np.arange(SIZE[1]), fine).ravel()
    center, _ = view.project(np.zeros((1, 3)) - view.origin)
    radius = view.scale / (10.0 if view.perspective else 1.0)
    inside = (x - center[0, 0]) ** 2 + (y[:, None] - center[0, 1]) ** 2 < radius**2
    covered = inside.reshape(SIZE[1], 64, SIZE[0], 64).mean(axis=(1, 3))
    assert 20 < radius < 30

    def error(quality: str) -> float:
        look = replace(request.look, quality=quality)
        alpha = refined(renderer, replace(request, look=look)).image()[..., 3] / 255
        return float(np.sqrt(((alpha - covered) ** 2).mean()))

    fast, balanced, best = (error(quality) for quality in SAMPLES)
    assert balanced < 0.4 * fast
    assert best < 0.5 * balanced


def test_many_pictures_and_transparent_ones_do_not_overflow(renderer: Renderer) -> None:
    rng = np.random.default_rng(4)
    pictures = [rng.integers(0, 256, (5, 7, 4), np.uint8) for _ in range(3)]
    pictures += [np.full((5, 7, 4), 255, np.uint8)] * 253
    for some in (pictures[:3], pictures, [np.zeros((5, 7, 4), np.uint8)] * 2):
        mean = PictureMean(renderer.gpu, (7, 5))
        buffer = renderer.gpu.ctx.buffer(reserve=140)
        for picture in some:
            buffer.write(picture)
            mean.add(buffer)
        mean.write(buffer)
        found = np.frombuffer(buffer.read(), np.uint8).reshape(5, 7, 4)
        np.testing.assert_array_equal(found, mean_of(some))
        mean.release()
        buffer.release()
