"""A patch is found on another sampling of its surface, and it is told how surely."""

from __future__ import annotations

import numpy as np
import pytest
from moving_hills import SPACING, MovingHills, moved, truth

from viewer.analysis.tracking.registration import PatchLevel, Placement, patch_of, registered
from viewer.analysis.tracking.surface import MomentSurface

LEVEL = PatchLevel(points=400, search=4.0, rounds=15, bending=0.05)


def surface(frame: int, *, is_colored: bool = True, is_flat: bool = False) -> MomentSurface:
    cloud = MovingHills(9).load(frame)
    positions = cloud.world()
    if is_flat:
        positions[:, 2] = 0.02 * np.random.default_rng(frame).standard_normal(len(positions))
    return MomentSurface(positions, SPACING, cloud.colors if is_colored else None)


def test_a_parabola_around_a_point_is_that_of_its_neighbours() -> None:
    from viewer.analysis.tracking.surface_kernels import NEAREST, fit_at

    chance = np.random.default_rng(1)
    xy = chance.uniform(-10, 10, (2000, 2))
    points = np.column_stack([xy, 0.03 * xy[:, 0] ** 2 - 0.02 * xy[:, 0] * xy[:, 1] + 0.3 * xy[:, 1]])
    held = MomentSurface(points, 0.5).held
    row = int(np.linalg.norm(xy, axis=1).argmin())
    assert fit_at(held, row)
    tangents, normal = held.frames[row, :2].astype(float), held.frames[row, 2].astype(float)
    away = points - points[row]
    near = np.argsort(np.linalg.norm(away, axis=1))[:NEAREST]
    u, v = (away[near] @ tangents.T).T
    c = held.parabolas[row, 0].astype(float)
    height = c[0] + c[1] * u + c[2] * v + c[3] * u * u + c[4] * u * v + c[5] * v * v
    assert np.abs(height - away[near] @ normal).max() < 0.01
    assert np.isclose(held.reaches[row], np.linalg.norm(away[near[-1]]), rtol=1e-5)


def test_colours_are_compared_as_brightness_and_two_opponents() -> None:
    colors = np.array([[255, 255, 255], [255, 0, 0], [0, 255, 0], [0, 0, 255]], np.uint8)
    surface = MomentSurface(np.eye(4, 3), SPACING, colors)
    expected = [[1, 0, 0], [1 / 3, 0.5, 0.25], [1 / 3, -0.5, 0.25], [1 / 3, 0, -0.5]]
    np.testing.assert_allclose(surface.held.colors, expected, atol=1e-6)


def test_rows_around_a_place_are_those_within_reach() -> None:
    chance = np.random.default_rng(2)
    points = chance.normal(0, 3, (3000, 3))
    points[0] = 1e4  # far from all others
    found = MomentSurface(points, 0.4)
    for place in (np.zeros(3), np.array([4.0, -5.0, 2.0])):
        wanted = np.flatnonzero(np.linalg.norm(points - place, axis=1) <= 1.5)
        assert found.rows_around(place, 1.5).tolist() == wanted.tolist()


@pytest.mark.parametrize("frame", [1, 3])
def test_a_patch_is_found_where_it_went(frame: int) -> None:
    before, after = surface(0), surface(frame)
    path = truth(3.0, -2.0, 5)
    patch = patch_of(before, path[0], 12.0, 400)
    assert patch is not None
    start = Placement(path[frame] + np.array([0.8, -0.7, 0.3]))
    found = registered(patch, after, start, LEVEL, np.eye(3))
    assert found is not None
    assert found.kept > 0.7
    assert found.middle > 0.9
    error = found.place - path[frame]
    assert np.linalg.norm(error) < 0.15 * SPACING
    edge = moved(np.array([[1.0, 0, 0], [0, 0, 0]]), frame)
    direction = (edge[0] - edge[1]) / np.linalg.norm(edge[0] - edge[1])
    assert found.turn[:, 0] @ direction > 0.998


def test_where_nothing_tells_the_place_along_the_surface_it_is_uncertain_along_it() -> None:
    before, after = (surface(frame, is_colored=False, is_flat=True) for frame in (0, 1))
    place = np.array([0.0, 0.0, 0.0])
    patch = patch_of(before, place, 10.0, 300)
    assert patch is not None
    found = registered(patch, after, Placement(place), LEVEL, np.eye(3))
    assert found is not None
    along, across = np.sqrt(np.diag(found.covariance))[:2], np.sqrt(found.covariance[2, 2])
    assert (along > 0.3).all()
    assert across < 0.05


def test_colors_tell_the_place_on_a_plane() -> None:
    flat = surface(0, is_flat=True)
    cloud = MovingHills(1).load(0)
    place = np.array([0.0, 0.0, 0.0])
    patch = patch_of(flat, place, 10.0, 300)
    assert patch is not None
    assert cloud.colors is not None
    found = registered(
        patch, surface(0, is_flat=True), Placement(place + np.array([0.7, 0.5, 0])), LEVEL, np.eye(3)
    )
    assert found is not None
    assert np.linalg.norm(found.place[:2] - place[:2]) < 0.1
    assert np.sqrt(np.diag(found.covariance))[:2].max() < 0.2
