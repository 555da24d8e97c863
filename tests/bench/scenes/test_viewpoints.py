from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from range_scenes import looking_at, sphere_view
from scenes import rarely

from viewer.bench.scenes import catalog
from viewer.bench.scenes.viewpoints import COVERAGE, covered_share, pod_viewpoints, viewpoints
from viewer.bench.truth import tessellation
from viewer.errors import InputError
from viewer.mesh.reference import trace
from viewer.scan.range_view import RangeView
from viewer.view import View

SIZE = (300, 200)
WITH_DATA = [
    "bunny",
    "armadillo",
    "horse",
    "dragon-100k",
    "igea",
    "crane",
    "horse-gallop",
    "owlii",
    "truedepth-head",
]


def directions(cameras: list) -> np.ndarray:
    ahead = np.array([np.subtract(camera.eye, camera.target) for camera in cameras])
    return ahead / np.linalg.norm(ahead, axis=1, keepdims=True)


def check(name: str, data: Path | None) -> None:
    subject = catalog.subject(name, data)
    mesh = subject.moment(subject.moments // 2).mesh
    cameras = viewpoints(mesh, 20, SIZE, up=subject.up)
    assert len(cameras) == 20
    covered = np.sort([trace(mesh, camera, SIZE).covered.mean() for camera in cameras])
    assert covered[0] >= COVERAGE[0]
    assert covered[-1] <= COVERAGE[1]
    np.testing.assert_allclose(covered, np.linspace(0.2745, 0.8255, 20), atol=0.015)
    # Evenly spread: no half of the sphere is left out.
    sides = directions(cameras)
    assert np.linalg.norm(sides.mean(axis=0)) < 0.25
    distances = [camera.distance / mesh.bounds.radius for camera in cameras]
    assert min(distances) >= 0.05
    assert max(distances) <= 20


@pytest.mark.parametrize("name", ["box", *rarely("sphere", "plane", "torus")])
def test_views_cover_what_they_should(name: str) -> None:
    check(name, None)


@pytest.mark.slow
@pytest.mark.parametrize("name", WITH_DATA)
def test_views_of_real_shapes_cover_what_they_should(name: str, data_dir: Path) -> None:
    check(name, data_dir)


def test_nothing_is_before_the_point_looked_at() -> None:
    mesh = tessellation.torus_mesh()
    for camera in viewpoints(mesh, 12, SIZE):
        picture = trace(mesh, camera, (1, 1))
        assert abs(picture.depth[0, 0] - camera.distance) < 1e-4


def test_seeds_decide_everything() -> None:
    mesh = tessellation.torus_mesh()
    assert viewpoints(mesh, 5, SIZE) == viewpoints(mesh, 5, SIZE)
    assert viewpoints(mesh, 5, SIZE) != viewpoints(mesh, 5, SIZE, seed=1)


def test_up_is_up() -> None:
    for camera in viewpoints(tessellation.cube_mesh(), 8, SIZE, up="-z"):
        assert camera.rotation()[1] @ (0, 0, -1) > 0


def test_a_portrait_and_a_single_view() -> None:
    mesh = tessellation.sphere_mesh()
    (camera,) = viewpoints(mesh, 1, (200, 300))
    assert abs(covered_share(mesh, camera, (200, 300)) - 0.55) < 0.01


def test_no_view_is_an_error() -> None:
    with pytest.raises(InputError, match="1 or more"):
        viewpoints(tessellation.sphere_mesh(), 0, SIZE)


# --- from where pods are -------------------------------------------------------------------


def heights() -> RangeView:
    """A tilted plane, seen in parallel from above: 50 samples a unit."""
    row, column = np.indices((60, 80), np.float32)
    return RangeView(
        depth=2 + 0.004 * (row + column), kind="height", mask=np.ones((60, 80), bool),
        fx=50, fy=50, cx=40, cy=30, world_to_camera=looking_at((0, 5, 0.1), (0, 0, 0)),
    )  # fmt: skip


@pytest.mark.parametrize("zoom", [0.25, 1, 8])
@pytest.mark.parametrize("view", [sphere_view((1, 0, 4)), heights()], ids=["perspective", "parallel"])
def test_a_sample_is_as_many_pixels_as_the_zoom_says(view: RangeView, zoom: float) -> None:
    cameras = pod_viewpoints([view], zoom, 4, SIZE)
    bounds = view.points().bounds()
    for camera in cameras:
        seen, target = View.of(camera, SIZE, np.zeros(3), bounds), np.array(camera.target)
        # A step at right angles to the pod's axis, from the sample to its neighbour.
        pixels, depth = view.project(target[None])
        spacing = (1 if view.kind == "height" else depth[0]) / view.fx
        side = view.world_to_camera[:3, :3].T @ [0, spacing, 0]
        (at, beside), _ = seen.project(np.stack([target, target + side]))
        np.testing.assert_allclose(at, np.array(SIZE) / 2, atol=1e-6)
        assert np.linalg.norm(beside - at) == pytest.approx(
            zoom, rel=0.03
        )  # not quite at right angles to the eye
        assert np.abs(pixels % 1 - 0.5).max() < 1e-3  # a sample's own place


def test_half_of_the_views_of_a_pod_look_from_twenty_degrees_aside() -> None:
    views = [sphere_view((0, 0, 4)), sphere_view((3, 0, 2), name="right")]
    cameras = pod_viewpoints(views, 4, 7, SIZE)
    assert len(cameras) == 7
    for number, camera in enumerate(cameras):
        own, aside = (
            np.subtract(eye, camera.target) for eye in (views[number // 2 % 2].eye, np.array(camera.eye))
        )
        cosine = own @ aside / np.linalg.norm(own) / np.linalg.norm(aside)
        angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        assert (angle > 10) == bool(number % 2)
        assert angle < 20.01
    again = pod_viewpoints(views, 0.5, 7, SIZE)
    assert [camera.target for camera in again] == [camera.target for camera in cameras]
    assert pod_viewpoints(views, 4, 2, SIZE, seed=1)[0].target != cameras[0].target
