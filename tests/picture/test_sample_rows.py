"""Rows that are samples of range views, against the same points merged."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sampling
from range_scenes import shape_view, sphere_view
from scenes import NOTHING
from test_laid_over import turned

from viewer.analysis.pick import Picked, before_gap, is_seen, pick
from viewer.analysis.surface_point import SurfacePoint
from viewer.backends import Backend
from viewer.camera import Camera
from viewer.document.anonymous import anonymous_request
from viewer.drawing.frame import render_frame
from viewer.drawing.plan import Effort, Ready, Waiting, make_plan
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.gpu.pose import GpuPose
from viewer.look import Look, color_table
from viewer.output.export import write_picture
from viewer.picture.rows import PointRows
from viewer.picture.surface import Surface
from viewer.scan.layers import NO_LAYERS, Layers
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.range_view import RangeView, merge

SIZE = (121, 87)
FLAT = Look(light="flat", eye_dome=False)
UTM = np.array([665187.25, 5648349.5, 241.75])
TURNED = turned(0.7, (3.0, -1.0, 12.0))
EYES = np.array([[0.0, 0, 4], [3, 0, 3]])
SCENES: dict[str, tuple[RangeView, ...]] = {
    "spheres": (sphere_view(EYES[0], size=(160, 140)), sphere_view(EYES[1], size=(90, 121), name="right")),
    "far": (sphere_view(UTM + EYES[0], UTM, (160, 140)), sphere_view(UTM + EYES[1], UTM, (90, 121))),
    "kinds": (shape_view("sphere", "range", "barrel")[0], shape_view("sphere", "height", measured=True)[0]),
}


def both(
    renderer: Renderer,
    scene: str,
    look: Look = FLAT,
    layers: Layers = NO_LAYERS,
    point_size: int = 2,
) -> tuple[Surface, Surface]:
    """Pictures of range views by their samples, and of the points that they see."""
    views = SCENES[scene]
    poses = Pose.of(0, 0.0, "x", views), Pose(0, 0.0, "x", merge(views))
    camera = Camera.orbit(layers.world_from_pose.bounds(poses[0].bounds), 30, 20, aspect=SIZE[0] / SIZE[1])
    surfaces = []
    for pose, backend in zip(poses, (sampling.BACKEND, "points"), strict=True):
        params = sampling.BACKEND.params_class(point_size=point_size)
        surface = Surface(renderer.gpu, SIZE)
        while render_frame(renderer, Request(pose, camera, backend, params, look, layers), surface):
            pass
        surfaces.append(surface)
    return surfaces[0], surfaces[1]


def is_merged(surface: Surface) -> bool:
    return surface.pose.pose.is_merged


def measured(surface: Surface) -> list[tuple[int, int]]:
    """Some pixels that show a sample."""
    return [(x, y) for y, x in np.argwhere(surface.row != NOTHING)[::97].tolist()]


@pytest.mark.parametrize("scene", SCENES)
def test_channels_are_those_of_the_points(renderer: Renderer, scene: str) -> None:
    samples, points = both(renderer, scene)
    np.testing.assert_array_equal(samples.row, samples.id)
    assert (samples.row != NOTHING).sum() > 1000
    arrays, expected = samples.arrays(), points.arrays()
    for name in ("id", "depth", "color", "coverage", "value", "level"):
        np.testing.assert_array_equal(arrays[name], expected[name], name)
    np.testing.assert_array_equal(samples.image(), points.image())
    assert not is_merged(samples)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("color_by", ["own", "plain", "id", "depth", "view", "confidence"])
def test_colours_are_those_of_the_points(renderer: Renderer, scene: str, color_by: str) -> None:
    if color_by == "confidence" and scene == "kinds":
        with pytest.raises(InputError, match="unknown colour source 'confidence'"):
            both(renderer, scene, replace(FLAT, color_by=color_by))
        return
    samples, points = both(renderer, scene, replace(FLAT, color_by=color_by))
    np.testing.assert_array_equal(samples.image(), points.image())
    np.testing.assert_array_equal(samples.value, points.value)
    assert samples.color_range == points.color_range
    assert not is_merged(samples)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("place", [False, True])
def test_heights_are_those_of_the_points(renderer: Renderer, scene: str, place: bool) -> None:
    layers = Layers(world_from_pose=TURNED) if place else NO_LAYERS
    for up in ("+x", "-z"):
        samples, points = both(renderer, scene, replace(FLAT, color_by="height", up=up), layers)
        np.testing.assert_array_equal(samples.value, points.value)
        assert samples.color_range == points.color_range
        assert samples.value_zero == points.value_zero
        steps = np.abs(samples.image().astype(int) - points.image()).max(axis=2)
        largest = np.abs(np.diff(color_table(FLAT.color_map).astype(int), axis=0)).max()
        assert steps.max() <= largest, "a neighbouring entry at most"
        assert (steps > 0).mean() < 0.01
        rows = samples.row[samples.row != NOTHING]
        heights = np.frombuffer(samples.row_values.buffer.read(), np.float32)[rows] + samples.value_zero
        expected = samples.value[samples.row != NOTHING]
        np.testing.assert_allclose(heights, expected, atol=2e-6 + 1e-7 * np.abs(expected).max())
        assert not is_merged(samples)


def test_numbers_of_samples_are_packed_once_and_counted(renderer: Renderer) -> None:
    samples, _ = both(renderer, "spheres", replace(FLAT, color_by="view"))
    pose, count = samples.pose, sum(view.depth.size for view in SCENES["spheres"])
    held = pose.uploaded_bytes
    assert samples.row_values is samples.row_values
    assert samples.row_values.buffer.size == 4 * count
    assert pose.uploaded_bytes == held
    for axis in ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0)):
        heights = samples.kind.heights(axis)
        assert samples.kind.heights(axis) is heights
        assert pose.uploaded_bytes == held + pose.samples.nbytes, "samples count the last axis alone"
    held = pose.uploaded_bytes
    for axis in ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0)):
        assert PointRows(pose).heights(axis).buffer.size == 4 * pose.pose.count
        assert pose.uploaded_bytes == held + 4 * pose.pose.count, "and so do points"


@pytest.mark.parametrize("scene", SCENES)
def test_normals_are_those_of_the_samples_around(renderer: Renderer, scene: str) -> None:
    samples, points = both(renderer, scene, Look(light="head"), Layers(world_from_pose=TURNED))
    assert not is_merged(samples)
    seen = samples.row != NOTHING
    np.testing.assert_allclose(np.linalg.norm(samples.normal[seen], axis=1), 1, rtol=1e-5)
    angles = np.degrees(np.arccos(np.clip((samples.normal * points.normal).sum(axis=2)[seen], -1, 1)))
    assert np.median(angles) < 1
    assert np.quantile(angles, 0.9) < 12
    lit = np.abs(samples.image().astype(int) - points.image())[seen][:, :3].max(axis=1)
    assert np.median(lit) <= 1
    colors = samples.image(replace(FLAT, color_by="normal"))[seen][:, :3] / 127.5 - 1
    np.testing.assert_allclose(colors, samples.normal[seen], atol=1.01 / 127.5)


def test_channels_are_resolved_from_samples(renderer: Renderer) -> None:
    for source in ("view", "height", "depth"):
        samples, _ = both(renderer, "spheres", replace(FLAT, color_by=source))
        for name in ("color", "normal", "value"):
            before = getattr(samples, name)
            samples.resolve(name)
            assert samples.is_own(name)
            np.testing.assert_allclose(getattr(samples, name), before, atol=2e-6)
        assert not is_merged(samples)
    bare = replace(SCENES["spheres"][0], color=None)
    surface = Surface(renderer.gpu, SIZE)
    pose = Pose.of(0, 0.0, "x", (bare,))
    request = Request(pose, Camera.orbit(pose.bounds), sampling.BACKEND, look=replace(FLAT, plain="#336699"))
    render_frame(renderer, request, surface)
    shown = surface.image()[surface.row != NOTHING]
    surface.resolve("color")
    assert (shown == [0x33, 0x66, 0x99, 255]).all()
    np.testing.assert_array_equal(
        surface.image(replace(FLAT, plain="#336699", background="#000000"))[0, 0], [0, 0, 0, 255]
    )


@pytest.mark.parametrize("scene", SCENES)
def test_picks_and_measurements_are_those_of_the_points(renderer: Renderer, scene: str) -> None:
    samples, points = both(renderer, scene, layers=Layers(world_from_pose=TURNED))
    pose = samples.pose.pose
    for x, y in measured(samples):
        one, other = pick(samples, x, y), pick(points, x, y)
        assert one is not None
        assert other is not None
        assert (one.id, one.row, one.level, one.scalars) == (other.id, other.row, other.level, other.scalars)
        # Points far from what is seen are at hand in a cloud alone.
        apart = np.linalg.norm(one.position - other.position)
        assert apart < 1e-3 * points.scanned.pose.spacing
        np.testing.assert_array_equal(one.point, other.point)
        np.testing.assert_array_equal(one.color, other.color)
        assert (one.normal, other.normal) == (None, None)
        assert one.spacing == pytest.approx(other.spacing, rel=1e-6)
        assert pick(samples, x, y, spacing=False).id == one.id
        assert is_seen(samples, one.position, 0.5)
        assert before_gap(samples, x, y) == before_gap(points, x, y)
        end = SurfacePoint.of(one, pose, place=TURNED)
        expected = SurfacePoint.of(other, points.pose.pose, place=TURNED)
        assert (end.frame, end.id, end.level, end.at_outline) == (0, expected.id, 0, expected.at_outline)
        assert end.uncertainty == pytest.approx(expected.uncertainty, rel=1e-2)
    place = Picked(TURNED.points(pose.bounds.center), level=2)
    filled, expected = (
        SurfacePoint.of(place, of, filled=True, place=TURNED).spacing for of in (pose, points.pose.pose)
    )
    assert filled == pytest.approx(expected, rel=1e-6)
    assert not is_merged(samples)


def test_a_sample_seen_through_a_gap_is_told_by_the_views_spacing(renderer: Renderer) -> None:
    samples, points = both(renderer, "spheres", point_size=1)
    pixels = [(x, y) for y, x in np.argwhere(np.isfinite(samples.depth)).tolist()]
    meant = [before_gap(samples, x, y) for x, y in pixels]
    agree = np.mean([one == before_gap(points, x, y) for one, (x, y) in zip(meant, pixels, strict=True)])
    assert agree > 0.98
    assert not is_merged(samples)
    assert samples.scanned.pose.spacing == pytest.approx(points.scanned.pose.spacing, rel=0.2)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("share", [1.0, 0.3])
def test_counts_are_those_of_the_points(renderer: Renderer, scene: str, share: float) -> None:
    pose = Pose.of(0, 0.0, "x", SCENES[scene])
    camera = Camera.orbit(pose.bounds, 30, 20, aspect=2.5)
    close = replace(camera, eye=tuple(np.array(camera.eye) * 0.6 + np.array(camera.target) * 0.4))
    surface = Surface(renderer.gpu, SIZE)
    request = Request(pose, close, sampling.BACKEND)
    assert render_frame(renderer, request, surface, share=share) == (share < 1)
    counts = surface.point_counts()
    assert counts["in"] == pose.count
    assert counts["drawn"] == len(np.unique(surface.row[surface.row != NOTHING]))
    assert sum(counts.values()) - counts["in"] == pose.count
    assert counts["outside"] > 0
    if share < 1:
        assert counts["preview"] == pytest.approx(surface.stats.left_out, rel=0.05)
        assert counts["preview"] == pytest.approx(0.7 * pose.count, rel=0.05)
    assert not pose.is_merged
    if share == 1:
        other = Surface(renderer.gpu, SIZE)
        render_frame(renderer, replace(request, backend="points", params=None), other)
        assert other.point_counts() == counts


def test_layers_are_those_of_the_points_which_they_are_by(renderer: Renderer) -> None:
    views = SCENES["spheres"]
    pose = Pose.of(0, 0.0, "x", views)
    numbers = np.sin(5 * pose.cloud.positions[:, 0].astype(float)) + 5e8
    layers, look = Layers({"deviation": numbers}), replace(FLAT, color_by="deviation")
    camera = Camera.orbit(pose.bounds, 30, 20, aspect=SIZE[0] / SIZE[1])
    surfaces = []
    for backend in (sampling.BACKEND, "points", sampling.BACKEND):  # of one pose on the GPU
        surface = Surface(renderer.gpu, SIZE)
        params = sampling.BACKEND.params_class(point_size=2)
        render_frame(renderer, Request(pose, camera, backend, params, look, layers), surface)
        surfaces.append(surface)
    samples, points, again = surfaces
    assert samples.pose is points.pose
    for surface in (samples, again):
        np.testing.assert_array_equal(surface.image(), points.image())
        np.testing.assert_array_equal(surface.value, points.value)
    x, y = measured(samples)[3]
    assert pick(samples, x, y).scalars == pick(points, x, y).scalars
    assert pick(samples, x, y).scalars["deviation"] == numbers[pick(points, x, y).row]
    with pytest.raises(InputError, match="the layer 'deviation' is"):
        Layers({"deviation": numbers[1:]}).check(pose)


def test_exports_are_those_of_the_points(renderer: Renderer, tmp_path: Path) -> None:
    samples, points = both(renderer, "spheres", replace(FLAT, color_by="view"))
    for surface, name in ((samples, "samples"), (points, "points")):
        for suffix in ("npz", "png", "exr"):
            write_picture(surface, tmp_path / f"{name}.{suffix}")
    with np.load(tmp_path / "samples.npz") as one, np.load(tmp_path / "points.npz") as other:
        for name in {*other} - {"normal"}:
            np.testing.assert_array_equal(one[name], other[name])
        assert np.linalg.norm(one["normal"], axis=2)[one["id"] != NOTHING] == pytest.approx(1, rel=1e-5)
    assert (tmp_path / "samples.png").read_bytes() == (tmp_path / "points.png").read_bytes()
    assert not is_merged(samples)


def test_anonymous_pictures_are_drawn_of_samples_too(renderer: Renderer) -> None:
    pose = Pose.of(3, 0.5, "somebody", SCENES["far"])
    camera = Camera.orbit(pose.bounds, 30, 20, aspect=SIZE[0] / SIZE[1])
    request = Request(pose, camera, sampling.BACKEND, look=replace(FLAT, color_by="view"))
    anonymous = anonymous_request(request, 0.0)
    surfaces = [Surface(renderer.gpu, SIZE) for _ in range(2)]
    for one, surface in zip((request, anonymous), surfaces, strict=True):
        render_frame(renderer, one, surface)
        assert not one.pose.is_merged
    same = surfaces[0].id == surfaces[1].id
    assert same.mean() > 0.999
    assert np.abs(anonymous.pose.origin).max() < 10
    np.testing.assert_array_equal(anonymous.pose.cloud.positions, pose.cloud.positions)


@pytest.mark.parametrize("backend", [sampling.BACKEND, "pyramidal"], ids=str)
def test_a_sequence_is_drawn_without_merging_anything(renderer: Renderer, backend: Backend | str) -> None:
    own, surface = Renderer(renderer.gpu), Surface(renderer.gpu, SIZE)
    poses = [
        Pose.of(index, index / 25, "", tuple(sphere_view(eye + 0.02 * index, size=(96, 80)) for eye in EYES))
        for index in range(8)
    ]
    camera = Camera.orbit(poses[0].bounds, aspect=SIZE[0] / SIZE[1])
    sizes = [pose.nbytes for pose in poses]
    for pose in poses:
        for look in (FLAT, Look(), Look(light="head"), replace(FLAT, color_by="height")):
            request = Request(pose, camera, backend, look=look)
            while isinstance(make_plan(own, request, SIZE, Effort.BEGIN, upload_ms=5), Waiting):
                pass
            while render_frame(own, request, surface, wait=False, moving=True):
                time.sleep(0.001)
            assert isinstance(make_plan(own, request, SIZE, Effort.NONE), Ready)
            assert surface.stats.backend == str(backend)
            assert (surface.row != NOTHING).sum() > 500
    assert not any(pose.is_merged for pose in poses)
    assert [pose.nbytes for pose in poses] == sizes
    assert own.resident(poses[-1]).estimated_bytes == 0
    own.release()


def test_points_alone_have_no_samples(renderer: Renderer) -> None:
    cloud = PointCloud.from_arrays(np.eye(3))
    pose = GpuPose(renderer.gpu, Pose(0, 0.0, "x", cloud))
    with pytest.raises(InputError, match="the scan has no range views"):
        _ = pose.pose.range_points
    request = Request(pose.pose, Camera.orbit(cloud.bounds()), sampling.BACKEND)
    with pytest.raises(InputError, match="Sampling draws only range views, but this scan has none"):
        render_frame(renderer, request, Surface(renderer.gpu, SIZE))
