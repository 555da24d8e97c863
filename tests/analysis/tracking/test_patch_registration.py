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
    error = found.position - path[frame]
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
    assert np.linalg.norm(found.position[:2] - place[:2]) < 0.1
    assert np.sqrt(np.diag(found.covariance))[:2].max() < 0.2


def test_tukey_weights_fall_to_zero() -> None:
    from viewer.analysis.tracking.robust_kernels import tukey_weight

    weights = [tukey_weight(residual, 2.0) for residual in (0.0, 1.0, -1.0, 4.685 * 1.99, 4.685 * 2.01)]
    assert weights[0] == 1
    assert weights[1] == weights[2] == pytest.approx((1 - (1 / 9.37) ** 2) ** 2)
    assert 0 < weights[3] < 1e-3
    assert weights[4] == 0


def test_the_robust_scale_ignores_outliers() -> None:
    from viewer.analysis.tracking.robust_kernels import robust_scale

    chance = np.random.default_rng(3)
    residuals = 5 + 0.3 * chance.standard_normal(4001)
    residuals[:800] = 1e3
    assert robust_scale(residuals, 5.0) == pytest.approx(0.3, rel=0.4)


def test_registration_stops_at_a_hundredth_of_the_spacing() -> None:
    from viewer.analysis.tracking.register_kernels import has_converged

    assert has_converged(0.0049**2, 0.5)
    assert not has_converged(0.0051**2, 0.5)


def test_correspondences_are_signed_distances_to_the_surface() -> None:
    from viewer.analysis.tracking.correspondence_kernels import (
        MovedPatch,
        find_correspondences,
        no_correspondences,
    )

    flat = surface(0, is_colored=False, is_flat=True)
    patch = patch_of(flat, np.zeros(3), 6.0, 200)
    assert patch is not None
    matches = no_correspondences(len(patch.local), 1)
    moved = MovedPatch(np.array([0.0, 0.0, 0.4]), np.eye(3), np.zeros(12))
    found, reach = find_correspondences(patch, flat.held, moved, 3 * SPACING, matches)
    assert found == matches.is_matched.sum() > 0.9 * len(patch.local)
    assert reach > 0
    distances = matches.residuals[matches.is_matched, 0] * np.sign(
        matches.gradients[matches.is_matched, 0, 2]
    )
    assert np.abs(distances - 0.4).max() < 0.1
    none, _ = find_correspondences(
        patch, flat.held, MovedPatch(np.array([0.0, 0.0, 90.0]), np.eye(3), np.zeros(12)), 1.0, matches
    )
    assert none == 0


@pytest.mark.parametrize("free", [0, 3, 12])
def test_factors_are_derivatives_of_the_residuals(free: int) -> None:
    """The side of the normal equations is the gradient of half the weighted squares."""
    from viewer.analysis.tracking.correspondence_kernels import (
        MovedPatch,
        find_correspondences,
        no_correspondences,
    )
    from viewer.analysis.tracking.factor_kernels import RIGID, add_factors, unknowns
    from viewer.analysis.tracking.robust_kernels import weigh

    before, after = surface(0), surface(1)
    path = truth(3.0, -2.0, 5)
    patch = patch_of(before, path[0], 8.0, 150)
    assert patch is not None
    moved = MovedPatch(path[1] + 0.1, np.eye(3), np.zeros(12))
    matches = no_correspondences(len(patch.local), 4)
    find_correspondences(patch, after.held, moved, 4 * SPACING, matches)
    weigh(matches, np.full(4, 1e-3))
    is_free = np.arange(12) < free
    count = unknowns(is_free)
    assert count == RIGID + free
    system, side = np.zeros((count, count)), np.zeros((count, 1))
    add_factors(patch, moved, matches, is_free, system, side)
    weights = patch.closeness[:, None] * matches.weights[:, :1] * np.ones((1, 4)) / matches.scales**2
    weights[:, 1:] *= matches.weights[:, 1:]
    middle = 0.5 * (matches.gradients + matches.own_gradients)
    rows = matches.is_matched
    expected = -((weights * matches.residuals)[rows, :, None] * middle[rows]).sum(axis=(0, 1))
    np.testing.assert_allclose(side[:3, 0], expected, rtol=1e-9)
    assert np.linalg.eigvalsh(np.tril(system) + np.tril(system, -1).T).min() > -1e-9 * np.abs(system).max()
