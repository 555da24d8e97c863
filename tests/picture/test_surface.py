from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import DRAWS_POINTS, NOTHING, rarely, sphere

from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.gpu import gl
from viewer.gpu.context import headless
from viewer.look import Look, color_table
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.splatting import squares

Draw = Callable[..., Surface]
CLOUD = sphere(3000)
CAMERA = Camera.orbit(CLOUD.bounds(), 30, 20)


def test_images_of_a_raster_are_copied_pixel_by_pixel(renderer: Renderer) -> None:
    ctx = renderer.gpu.ctx
    raster = gl.Raster(ctx, (7, 5))
    given = np.arange(35, dtype=np.uint32), np.arange(35, dtype=np.float32) / 7
    buffers = [ctx.buffer(reserve=4 * 35) for _ in given]
    for image, values in zip(raster.images, given, strict=True):
        image.write(values.tobytes())
    raster.copy_to(*buffers)
    for buffer, values in zip(buffers, given, strict=True):
        np.testing.assert_array_equal(np.frombuffer(buffer.read(), values.dtype), values)
    raster.release()


def test_the_depth_buffer_is_really_32_bit_float(renderer: Renderer) -> None:
    raster = gl.Raster(renderer.gpu.ctx, (32, 16))
    assert raster.depth_is_float32()
    raster.release()


def test_a_picture_too_long_for_the_rasteriser_is_refused(draw: Draw) -> None:
    size = (gl.max_raster_edge() + 1, 4)
    with pytest.raises(InputError, match="along an edge"):
        draw(CLOUD, CAMERA, size, "surfels", Look(), {"instancing": "gs"})
    assert draw(CLOUD, CAMERA, size, "points", Look()).size == size


def test_a_flat_picture_holds_the_colours_of_the_points(draw: Draw) -> None:
    look = Look(light="flat", background="#0a141e28")
    surface = draw(CLOUD, CAMERA, (80, 60), "surfels", look, {"passes": "one"})
    image, row = surface.image(), surface.row
    covered = row != NOTHING
    np.testing.assert_array_equal(image[covered][:, :3], CLOUD.colors[row[covered]][:, :3])
    assert (image[~covered] == [10, 20, 30, 40]).all()


def srgb(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    linear = np.clip(linear, 0, 1)
    return np.where(linear > 0.0031308, 1.055 * linear ** (1 / 2.4) - 0.055, 12.92 * linear)


def test_head_light_is_phong(draw: Draw) -> None:
    look = Look(light="head", ambient=0.2, diffuse=0.7, specular=0.3, shininess=10)
    surface = draw(CLOUD, CAMERA, (80, 60), "surfels", look)
    covered = surface.row != NOTHING
    y, x = np.nonzero(covered)
    view = surface.view
    rays = np.stack([(x + 0.5 - 40) / view.scale, -(y + 0.5 - 30) / view.scale, -np.ones(len(x))], axis=1)
    to_eye = -rays / np.linalg.norm(rays, axis=1, keepdims=True)
    normal = surface.normal[covered] @ view.rotation.T
    facing = np.abs((normal * to_eye).sum(axis=1))
    # Light comes from the eye: the mirrored ray meets it at twice the angle.
    highlight = np.maximum(2 * facing**2 - 1, 0) ** 10
    expected = surface.color[covered] * (0.2 + 0.7 * facing[:, None]) + 0.3 * highlight[:, None]
    np.testing.assert_allclose(surface.image()[covered][:, :3] / 255, srgb(expected), atol=1.5 / 255)


def test_eye_dome_darkens_only_what_lies_behind_a_step(draw: Draw) -> None:
    x, y = np.meshgrid(np.linspace(-1, 1, 200), np.linspace(-1, 1, 200))
    z = np.where(x > 0, -3.0, -3.3)
    cloud = PointCloud.from_arrays(np.stack([x, y, z], axis=2).reshape(-1, 3))
    camera = Camera(eye=(0, 0, 0), target=(0, 0, -1), fov_y=20)
    flat = draw(cloud, camera, (60, 60), "points", Look(light="flat")).image()[..., 0].astype(int)
    dome = draw(cloud, camera, (60, 60), "points", Look()).image()[..., 0].astype(int)
    darker = (flat - dome > 20).any(axis=0)
    assert darker.any()
    assert np.ptp(np.nonzero(darker)[0]) <= 2, "a line along the step"
    assert np.nonzero(darker)[0].max() <= 30, "on its far side"


@pytest.mark.parametrize("source", ["depth", "height", "q"])
def test_numbers_are_coloured_by_the_map(draw: Draw, source: str) -> None:
    cloud = replace(CLOUD, scalars={"q": CLOUD.positions[:, 0] * 1e3})
    look = Look(color_by=source, light="flat", low=-0.5, high=0.5, color_map="cividis")
    look = look if source != "depth" else replace(look, low=3.0, high=5.0)
    look = look if source != "q" else replace(look, low=-500.0, high=500.0)
    surface = draw(cloud, CAMERA, (80, 60), "surfels", look)
    covered = surface.row != NOTHING
    value = surface.value[covered].astype(np.float64)
    assert np.isnan(surface.value[~covered]).all()
    expected = {
        "depth": surface.depth[covered],
        "height": CLOUD.positions[surface.row[covered], 1],
        "q": cloud.scalars["q"][surface.row[covered]],
    }[source]
    np.testing.assert_allclose(value, expected, rtol=1e-6, atol=1e-6)
    t = np.clip((value - look.low) / (look.high - look.low), 0, 1)
    index = np.floor(t * 255 + 0.5).astype(int)
    table = color_table("cividis").astype(int)
    got = surface.image()[covered][:, :3].astype(int)
    # float32 may round to the neighbouring entry.
    near = (
        np.abs(got[:, None] - table[np.clip(index[:, None] + [-1, 0, 1], 0, 255), :3]).max(axis=2).min(axis=1)
    )
    assert near.max() == 0


def test_a_look_can_be_changed_afterwards(draw: Draw) -> None:
    surface = draw(CLOUD, CAMERA, (40, 30), "surfels", Look(light="flat"), {"passes": "one"})
    red = draw(CLOUD, CAMERA, (40, 30), "surfels", Look(light="flat", color_by="plain", plain="#ff0000"))
    np.testing.assert_array_equal(
        surface.image(Look(light="flat", color_by="plain", plain="#ff0000")), red.image()
    )


@pytest.mark.parametrize(
    ("look", "message"), [({"color_by": "temperature"}, "Known:.*height"), ({"color_by": "q2"}, "q2")]
)
def test_unknown_colour_sources_are_explained(draw: Draw, look: dict[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        draw(CLOUD, CAMERA, (8, 8), "points", Look(**look))


@pytest.mark.parametrize("size", [(0, 5), (5, -1), (1 << 17, 1 << 17)])
def test_impossible_sizes_are_explained(renderer: Renderer, size: tuple[int, int]) -> None:
    with pytest.raises(InputError, match=r"cannot have|too large"):
        Surface(renderer.gpu, size)


@pytest.mark.parametrize("name", ["surfels", *rarely(*(name for name in DRAWS_POINTS if name != "surfels"))])
def test_passes_add_up_to_the_frame(renderer: Renderer, name: str) -> None:
    cloud = sphere(200_000)
    surface = Surface(renderer.gpu, (960, 640))
    request = Request(Pose(0, 0.0, "x", cloud), Camera.orbit(cloud.bounds()), name)
    shares = []
    try:
        renderer.gpu.timers.enabled = True
        for _ in range(7):
            render_frame(renderer, request, surface)
            shares.append(surface.stats.gpu_ms / surface.stats.cpu_ms)
    finally:
        renderer.gpu.timers.enabled = False
    assert len(surface.stats.passes) >= 3
    if renderer.gpu.timers.kind == "finish":  # a query leaves out what the CPU does
        assert 0.7 < np.median(shares) <= 1.0


def test_timers_cost_nothing_while_off(renderer: Renderer, draw: Draw) -> None:
    assert draw(CLOUD, CAMERA, (20, 20)).stats.passes == []


def test_poses_leave_the_gpu_when_the_budget_is_spent(renderer: Renderer) -> None:
    small = Renderer(renderer.gpu, budget_bytes=200_000)
    surface = Surface(renderer.gpu, (32, 24))
    poses = [Pose(i, 0.0, "x", sphere(5000)) for i in range(6)]
    for pose in poses:
        render_frame(small, Request(pose, CAMERA, "surfels"), surface)
    one = 5000 * (12 + 12 + 4 + 4)
    assert one <= small.nbytes <= 200_000 + one
    render_frame(small, Request(poses[-1], CAMERA, "surfels"), surface)
    assert surface.stats.upload_ms == 0, "still there"
    render_frame(small, Request(poses[0], CAMERA, "surfels"), surface)
    assert surface.stats.upload_ms > 0, "uploaded anew"
    small.release()


def test_only_what_is_read_is_uploaded(renderer: Renderer) -> None:
    own = Renderer(renderer.gpu)
    surface = Surface(renderer.gpu, (32, 24))
    pose = Pose(0, 0.0, "x", sphere(1000))
    render_frame(own, Request(pose, CAMERA, "points", None, Look(light="flat", color_by="plain")), surface)
    assert own.nbytes == 1000 * 12
    render_frame(own, Request(pose, CAMERA, "points", None, Look(light="flat")), surface)
    assert own.nbytes == 1000 * 16
    own.release()


def test_sparse_points_list_their_pixels_as_a_search_would(
    draw: Draw, monkeypatch: pytest.MonkeyPatch
) -> None:
    sparse = draw(CLOUD, CAMERA, (300, 200), "points", Look())
    assert "pixels" in sparse.stats.skipped
    monkeypatch.setattr(squares, "_LIST_BELOW", 0)
    searched = draw(CLOUD, CAMERA, (300, 200), "points", Look())
    assert "pixels" not in searched.stats.skipped
    np.testing.assert_array_equal(sparse.image(), searched.image())


def test_every_point_is_accounted_for(draw: Draw) -> None:
    # In a line along the view axis: the first hides the next, one is behind the eye, one beside.
    points = [[0, 0, -2.0], [0, 0, -3], [0, 0, 1], [50, 0, -2], [0, 0, 0], [np.nan, 0, 0]]
    camera = Camera(eye=(0, 0, 0), target=(0, 0, -1))
    counts = draw(PointCloud.from_arrays(points), camera, (9, 9)).point_counts()
    assert counts == {"in": 6, "drawn": 1, "dropped": 1, "outside": 3, "hidden": 1}


def test_two_contexts_do_not_disturb_each_other(renderer: Renderer) -> None:
    other = Renderer(headless())
    pictures = []
    for own in (renderer, other, renderer, other):
        surface = Surface(own.gpu, (40, 30))
        render_frame(own, Request(Pose(0, 0.0, "x", CLOUD), CAMERA, "surfels"), surface)
        pictures.append((surface, surface.image(), surface.image(Look(color_by="depth"))))
    for surface, picture, _ in pictures:
        np.testing.assert_array_equal(picture, pictures[0][1])
        np.testing.assert_array_equal(surface.image(Look(color_by="depth")), pictures[0][2])
    other.release()


def test_heights_and_times_far_from_zero_keep_their_steps(draw: Draw) -> None:
    shift = np.array([0, 4.5e6, 0])
    seconds = np.linspace(0, 255, 3000)
    near = replace(CLOUD, scalars={"t": seconds})
    far = replace(sphere(3000, center=tuple(shift)), scalars={"t": seconds + 1.7e9})
    eye, target = (tuple(np.add(v, shift)) for v in (CAMERA.eye, CAMERA.target))
    moved = replace(CAMERA, eye=eye, target=target)
    for source in ("height", "t"):
        look = Look(color_by=source, light="flat")
        here = draw(near, CAMERA, (80, 60), "surfels", look)
        there = draw(far, moved, (80, 60), "surfels", look)
        same = here.row == there.row
        assert same.mean() > 0.99
        steps = np.abs(here.image().astype(int) - there.image())[same]
        assert steps.max() <= 6, "one entry of the colour map"
        assert len(np.unique(there.image().reshape(-1, 4), axis=0)) > 100


def test_height_is_along_the_world_not_the_picture(draw: Draw) -> None:
    from_above = Camera.orbit(CLOUD.bounds(), 0, 90)
    surface = draw(CLOUD, from_above, (80, 60), "surfels", Look(color_by="height"))
    covered = surface.row != NOTHING
    np.testing.assert_allclose(
        surface.value[covered], CLOUD.positions[surface.row[covered], 1], rtol=1e-5, atol=1e-6
    )


def test_colours_by_id_are_those_of_the_file(draw: Draw) -> None:
    look = Look(color_by="id", light="flat")
    bad = CLOUD.positions.copy()
    bad[:100] = np.nan
    holed = PointCloud.from_arrays(bad, normals=CLOUD.normals, radii=CLOUD.radii)
    whole, part = (draw(cloud, CAMERA, (80, 60), "surfels", look) for cloud in (CLOUD, holed))
    same = whole.id == part.id
    assert same.mean() > 0.9
    np.testing.assert_array_equal(whole.image()[same], part.image()[same])


@pytest.mark.slow
def test_more_pixels_than_one_dimension_of_a_dispatch_takes(renderer: Renderer) -> None:
    size = (8192, 2304)  # 73 728 work groups of covered pixels
    x, y = np.array([-1.0, 1, 1, -1]) * 9, np.array([-1.0, -1, 1, 1]) * 9
    wall = PointCloud.from_arrays(
        np.stack([x, y, np.full(4, -2.0)], axis=1), normals=[[0, 0, 1]] * 4, radii=[40.0] * 4
    )
    surface = Surface(renderer.gpu, size)
    camera = Camera(eye=(0, 0, 0), target=(0, 0, -1), fov_y=20)
    look = Look(light="flat", color_by="plain", plain="#336699")
    render_frame(renderer, Request(Pose(0, 0.0, "x", wall), camera, "surfels", None, look), surface)
    assert len(surface.covered) == size[0] * size[1]
    assert (surface.image() == [0x33, 0x66, 0x99, 255]).all()
    surface.release()


def test_normals_are_shown_in_the_fake_colour_of_the_paper(draw: Draw) -> None:
    look = Look(light="flat", color_by="normal")
    surface = draw(CLOUD, CAMERA, (80, 60), "surfels", look, {"passes": "one"})
    covered = surface.row != NOTHING
    expected = np.rint((CLOUD.normals[surface.row[covered]] * 0.5 + 0.5) * 255).astype(int)
    assert np.abs(surface.image()[covered, :3].astype(int) - expected).max() <= 1


@pytest.mark.parametrize(("few", "many"), [((3, 2), (9, 6)), ((3, 2), (7, 5)), ((10, 7), (14, 10))])
def test_a_surface_of_few_pixels_is_read_as_one_of_many(
    renderer: Renderer, few: tuple[int, int], many: tuple[int, int]
) -> None:
    pose = Pose(0, 0.0, "ball", sphere(500))
    request = Request(pose, Camera.orbit(pose.bounds, 30, 20), "surfels")
    small, large = Surface(renderer.gpu, few), Surface(renderer.gpu, few, many)
    for surface in (small, large):
        render_frame(renderer, request, surface)
    columns, rows = ([int((i + 0.5) * n / m) for i in range(m)] for n, m in zip(few, many, strict=True))
    assert np.array_equal(large.image(), small.image()[rows][:, columns])
    for name, channel in large.arrays().items():
        assert np.array_equal(
            channel, small.arrays()[name][rows][:, columns], equal_nan=channel.dtype.kind == "f"
        )
    assert np.array_equal(large.depth, small.depth)
