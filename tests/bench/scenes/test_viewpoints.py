from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.bench.scenes import catalog
from viewer.bench.scenes.viewpoints import COVERAGE, covered_share, viewpoints
from viewer.bench.truth import tessellation
from viewer.errors import InputError
from viewer.mesh.reference import trace

SIZE = (300, 200)
WITHOUT_DATA = ["sphere", "plane", "box", "torus"]
WITH_DATA = [
    "bunny",
    "armadillo",
    "horse",
    "dragon-100k",
    "igea",
    "crane",
    "horse-gallop",
    "owlii",
    pytest.param("truedepth-head", marks=pytest.mark.slow),
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


@pytest.mark.parametrize("name", WITHOUT_DATA)
def test_views_cover_what_they_should(name: str) -> None:
    check(name, None)


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
