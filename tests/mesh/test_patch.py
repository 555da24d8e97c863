from __future__ import annotations

import numpy as np
import pytest

from viewer.mesh.patch import Patch

SQUARE = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], float)
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def area(patch: Patch) -> float:
    return float(np.linalg.norm(patch.doubled, axis=1).sum() / 2)


@pytest.mark.parametrize(
    ("place", "faces", "vertices", "away"),
    [
        ((1.5, 0.5, 3), 4, 5, 3),  # within a face
        ((1, 1, 0), 4, 5, 0),  # on the edge between two
        ((1, -1, 0), 3, 5, 1),  # off an edge of one
        ((2, 2, 0), 2, 4, 0),  # at a corner
        ((-3, -4, 0), 2, 4, 5),
    ],
)
def test_a_place_becomes_a_vertex(place: tuple[float, ...], faces: int, vertices: int, away: float) -> None:
    patch = Patch.of(SQUARE, FACES)
    found = patch.nearest(np.array(place, float))
    assert found.away == pytest.approx(away)
    divided, number = patch.with_point(found)
    assert (len(divided.faces), len(divided.vertices)) == (faces, vertices)
    assert divided.vertices[number] == pytest.approx(np.clip(place, 0, [2, 2, 0]))
    assert area(divided) == pytest.approx(4)
    assert (divided.doubled[:, 2] > 0).all()
    again = Patch.of(divided.vertices, divided.faces)
    assert len(again.vertices) == vertices


def test_the_nearest_place_is_that_of_many() -> None:
    rng = np.random.default_rng(0)
    patch = Patch.of(rng.standard_normal((30, 3)), np.arange(30).reshape(10, 3))
    weights = rng.dirichlet(np.ones(3), 20_000)
    places = np.concatenate([weights @ face for face in patch.vertices[patch.faces]])
    for target in 2 * rng.standard_normal((10, 3)):
        found = patch.nearest(target)
        least = np.linalg.norm(places - target, axis=1).min()
        assert least - 0.05 < found.away <= least
        assert np.linalg.norm(found.position - target) == pytest.approx(found.away)
        assert found.weights @ patch.vertices[patch.faces[found.face]] == pytest.approx(found.position)


def test_points_are_joined_without_small_holes() -> None:
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(0, 30, (900, 2)), np.zeros(900)])
    points = points[np.linalg.norm(points - [15, 15, 0], axis=1) > 2.2]
    patch = Patch.of_points(points, np.tile([0.0, 0, 1], (len(points), 1)), 1.0)
    assert 830 < area(patch) < 900
    half = np.delete(np.arange(patch.faces.size), np.concatenate(patch.pairs))
    rim = patch.vertices[patch.faces.ravel()[half]]
    assert not ((rim > [5, 5, -1]).all(axis=1) & (rim < [25, 25, 1]).all(axis=1)).any()
    assert set(patch.sources[patch.sources >= 0].tolist()) <= set(range(len(points)))


def test_bends_are_squared_angles() -> None:
    roof = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [-1, 0, 1]], float)
    patch = Patch.of(roof, np.array([[0, 2, 1], [0, 1, 3]]))
    assert patch.bends == pytest.approx((np.pi / 4) ** 2)


def test_parts_are_what_faces_connect() -> None:
    patch = Patch.of(np.random.default_rng(0).random((7, 3)), np.array([[0, 1, 2], [1, 2, 3], [4, 5, 6]]))
    assert len(set(patch.parts.tolist())) == 2
