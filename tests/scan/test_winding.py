"""Winding numbers of points against exact solid angles of the triangles that they lie on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import viewer
from viewer.bench.scenes import samples
from viewer.errors import InputError
from viewer.mesh.triangles import Mesh
from viewer.scan.points import PointCloud
from viewer.scan.winding import winding_number
from viewer.task import Cancelled, Task

COUNT = 30_000


@pytest.fixture(scope="module")
def torus() -> Mesh:
    """A torus of 2 x 64 x 32 triangles, whose axis is y."""
    turn, angle = np.meshgrid(np.arange(64) * np.pi / 32, np.arange(32) * np.pi / 16, indexing="ij")
    ring = 1 + 0.4 * np.cos(angle)
    vertices = np.stack([ring * np.cos(turn), 0.4 * np.sin(angle), ring * np.sin(turn)], axis=-1)
    number = np.arange(64 * 32).reshape(64, 32)
    right, up = np.roll(number, -1, axis=0), np.roll(number, -1, axis=1)
    both = np.roll(right, -1, axis=1)
    faces = np.concatenate(
        [np.stack(three, axis=-1).reshape(-1, 3) for three in ((number, up, both), (number, both, right))]
    )
    return Mesh(PointCloud.from_arrays(vertices.reshape(-1, 3)), faces.astype(np.uint32))


def sampled(mesh: Mesh, count: int = COUNT) -> tuple[NDArray, NDArray, NDArray]:
    """Points, normals and areas of a mesh."""
    cloud = samples.on_mesh(mesh, count)
    assert cloud.normals is not None
    area = np.linalg.norm(mesh.areas(), axis=1).sum() / 2
    return cloud.world(), cloud.normals, np.full(count, area / count)


def exact(mesh: Mesh, places: NDArray) -> NDArray:
    """The sum of the solid angles of triangles (van Oosterom and Strackee 1983), in shares of 4 pi."""
    corners = mesh.points.world()[mesh.faces][None] - places[:, None, None]
    a, b, c = np.moveaxis(corners, 2, 0)
    sizes = [np.linalg.norm(side, axis=2) for side in (a, b, c)]
    over = np.einsum("qfi,qfi->qf", a, np.cross(b, c))
    under = (
        np.prod(sizes, axis=0)
        + (a * b).sum(axis=2) * sizes[2]
        + (b * c).sum(axis=2) * sizes[0]
        + (c * a).sum(axis=2) * sizes[1]
    )
    return (2 * np.arctan2(over, under)).sum(axis=1) / (4 * np.pi)


def places_off(points: NDArray, normals: NDArray, apart: float) -> NDArray:
    some = np.random.default_rng(2).choice(len(points), 60, replace=False)
    return np.concatenate([points[some] + side * apart * normals[some] for side in (1, -1)])


def test_a_closed_surface_surrounds_what_is_inside(torus: Mesh) -> None:
    points, normals, areas = sampled(torus)
    spacing = np.sqrt(areas[0])
    places = places_off(points, normals, 8 * spacing)
    found = winding_number(points, normals, areas, places)
    assert found == pytest.approx(np.repeat([0.0, 1.0], 60), abs=0.01)
    assert found == pytest.approx(exact(torus, places), abs=0.01)
    assert viewer.winding_number(points, -normals, areas, places) == pytest.approx(-found, abs=1e-12)


@pytest.mark.parametrize(
    "part", [lambda mesh: mesh.points.world()[:, 1] > 0, lambda mesh: mesh.points.world()[:, 0] > 0.3]
)
def test_an_open_surface_has_the_solid_angle_of_its_triangles(
    torus: Mesh, part: Callable[[Mesh], NDArray]
) -> None:
    open_ = Mesh(torus.points, torus.faces[part(torus)[torus.faces].all(axis=1)])
    points, normals, areas = sampled(open_)
    rng = np.random.default_rng(1)
    far = rng.uniform(-2, 2, (40, 3))
    near = places_off(points, normals, 8 * np.sqrt(areas[0]))
    places = np.concatenate([far, near])
    found = winding_number(points, normals, areas, places)
    clear = np.linalg.norm(points[None] - places[:, None], axis=2).min(axis=1) > 6 * np.sqrt(areas[0])
    assert clear.sum() > 100
    truth = exact(open_, places)
    assert found[clear] == pytest.approx(truth[clear], abs=0.01)
    assert np.ptp(truth) > 0.5


def test_the_tree_gives_the_sum_over_all_points(torus: Mesh) -> None:
    points, normals, areas = sampled(torus, 3000)
    places = np.random.default_rng(3).uniform(-1.5, 1.5, (200, 3))
    apart = points[None] - places[:, None]
    cubes = np.linalg.norm(apart, axis=2) ** 3
    plain = ((apart * normals).sum(axis=2) * areas / cubes).sum(axis=1) / (4 * np.pi)
    found = winding_number(points, normals, areas, places)
    assert found == pytest.approx(plain, abs=4e-3)


def test_a_point_adds_nothing_at_its_own_place(torus: Mesh) -> None:
    points, normals, areas = sampled(torus)
    on_it = winding_number(points, normals, areas, points[::50])
    assert np.median(on_it) == pytest.approx(0.5, abs=0.03)
    assert winding_number([[1.0, 2.0, 3.0]], [[0.0, 0.0, 1.0]], [2.0], [[1.0, 2.0, 3.0]]) == 0


def test_one_point_is_a_dipole() -> None:
    found = winding_number([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]], [4 * np.pi], [[0, 0, -2.0], [3.0, 0, 0]])
    assert found == pytest.approx([0.25, 0.0])


def test_nothing_surrounds_nothing() -> None:
    none = np.empty((0, 3))
    assert winding_number(none, none, np.empty(0), np.ones((3, 3))).tolist() == [0, 0, 0]
    assert winding_number(np.ones((1, 3)), np.ones((1, 3)), [1.0], none).shape == (0,)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({0: np.ones((4, 2))}, "have shapes"),
        ({1: np.ones((5, 3))}, "have shapes"),
        ({2: np.ones((4, 1))}, "have shapes"),
        ({3: np.ones(3)}, "queries have shape"),
        ({3: [[0.0, np.nan, 0.0]]}, "not finite"),
    ],
)
def test_arrays_that_do_not_fit(change: dict, what: str) -> None:
    arrays = [np.ones((4, 3)), np.ones((4, 3)), np.ones(4), np.ones((1, 3))]
    for number, array in change.items():
        arrays[number] = array
    with pytest.raises(InputError, match=what):
        winding_number(*arrays)


def test_it_stops_where_it_is_cancelled(torus: Mesh) -> None:
    task = Task("x")
    task.cancel()
    with task.current(), pytest.raises(Cancelled):
        winding_number(*sampled(torus, 100), np.zeros((5, 3)))
