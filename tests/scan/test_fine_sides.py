"""The side of normals by winding numbers, where links and the view from outside are unsure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.scan import fine_kernels, fine_sides, sheet_kernels
from viewer.scan.estimate import cloud_normals
from viewer.scan.open import open_scan
from viewer.scan.points import Orientation, PointCloud
from viewer.scan.sides import _agreement
from viewer.task import Cancelled, Task


def lens(count: int, flatness: float) -> tuple[NDArray, NDArray]:
    """Points at random on a flat ellipsoid, and directions of its normals."""
    points = np.random.default_rng(1).normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points * [1, 1, flatness], points / [1, 1, flatness]


def flipped(points: NDArray, truth: NDArray, orientation: Orientation) -> float:
    normals = cloud_normals(PointCloud.from_arrays(points), orientation=orientation)
    return float(np.mean(np.einsum("ij,ij->i", normals, truth) < 0))


def test_the_two_sides_of_a_flat_body_point_apart() -> None:
    """The body is at most as thick as half the distance between its points."""
    points, normals = lens(3000, 0.02)
    assert flipped(points, normals, "quick") > 0.45, "all face the front"
    assert flipped(points, normals, "fine") < 0.25
    assert flipped(points, normals, "auto") < 0.25


def test_a_body_that_links_are_sure_of_stays_as_it_is() -> None:
    points, normals = lens(3000, 0.5)
    cloud = PointCloud.from_arrays(points)
    quick, auto, fine = (cloud_normals(cloud, orientation=way) for way in ("quick", "auto", "fine"))
    assert np.array_equal(quick, auto)
    assert np.array_equal(quick, fine)
    assert np.einsum("ij,ij->i", fine, normals).min() > 0


@pytest.mark.parametrize("depth", [0.1, 0.4])
def test_open_surfaces_face_the_front(depth: float) -> None:
    x, y = np.random.default_rng(2).uniform(-1, 1, (2, 5000))
    for bowl in (depth, -depth):
        points = np.stack([x, y, bowl * (x * x + y * y)], axis=1)
        assert cloud_normals(PointCloud.from_arrays(points), orientation="fine")[:, 2].min() > 0


def test_a_viewpoint_decides_alone() -> None:
    points, _ = lens(3000, 0.02)
    normals = cloud_normals(PointCloud.from_arrays(points), viewpoint=(0, 0, 9), orientation="fine")
    assert np.einsum("ij,ij->i", normals, [0, 0, 9] - points).min() >= -1e-6


def test_sides_are_the_same_in_any_order() -> None:
    points, _ = lens(3000, 0.02)
    order = np.random.default_rng(8).permutation(len(points))
    here, there = (
        cloud_normals(PointCloud.from_arrays(some), orientation="fine") for some in (points, points[order])
    )
    assert np.array_equal(here[order], there)


@pytest.mark.parametrize("count", [3, 9, 12, 25])
def test_few_points(count: int) -> None:
    points, _ = lens(count, 0.5)
    normals = cloud_normals(PointCloud.from_arrays(points), orientation="fine")
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1, abs=1e-5)


def test_it_stops_where_it_is_cancelled() -> None:
    rng, task = np.random.default_rng(0), Task("x")
    points = rng.normal(size=(100, 3))
    near = np.argsort(np.linalg.norm(points[:, None] - points, axis=2), axis=1)[:, :20].astype(np.int32)
    links = np.column_stack([near[:, 0], near[:, 1]]).astype(np.int32)
    bonds = fine_sides.Bonds(links, np.ones(100, np.float32), np.zeros(100), np.zeros(100))
    task.cancel()
    with task.current(), pytest.raises(Cancelled):
        fine_sides.better_sides(points, np.tile(np.float32([0, 0, 1]), (100, 1)), near, bonds)


@pytest.mark.parametrize(("seen", "outside", "turns"), [(1.0, 0.0, True), (1.0, 1.0, False)])
def test_that_it_faces_the_front_keeps_no_side_that_links_and_winding_number_contradict(
    seen: float, outside: float, turns: bool
) -> None:
    """A cap of a body points inwards."""
    points, truth = lens(1500, 0.5)
    cap = points[:, 0] > 0.9
    normals = truth / np.linalg.norm(truth, axis=1, keepdims=True) * np.where(cap, -1, 1)[:, None]
    near = np.argsort(np.linalg.norm(points[:, None] - points, axis=2), axis=1)[:, :20].astype(np.int32)
    links = np.column_stack([np.repeat(near[:, 0], 8), near[:, 1:9].ravel()]).astype(np.int32)
    weights = np.where(cap[links[:, 0]] == cap[links[:, 1]], 1.0, -1.0)
    bonds = fine_sides.Bonds(links, weights, seen * cap, outside * cap)
    signs = np.where(cap, -1, 1).astype(np.int8)
    accepted = fine_sides._accepted(fine_sides._Field(points, normals, near), bonds, signs)
    assert np.array_equal(accepted, signs if turns else np.ones_like(signs))


def test_contradicting_links_are_unsure() -> None:
    assert not fine_sides.is_unsure(np.ones(1000))
    assert fine_sides.is_unsure(np.append(np.ones(100), -1.0))
    assert not fine_sides.is_unsure(np.empty(0))


def test_winding_numbers_of_groups_sum_to_that_of_all_points() -> None:
    """One group has many parts, and another none of the points."""
    points, normals = lens(1500, 0.5)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    near = np.argsort(np.linalg.norm(points[:, None] - points, axis=2), axis=1)[:, :20].astype(np.int32)
    field = fine_sides._Field(points, normals, near)
    group = np.where(points[:, 0] > 0.8, 0, 2)
    fields = field.of_groups(group, 3)
    assert not fields[:, 1].any()
    assert fields.sum(axis=1) == pytest.approx(field.whole(), abs=0.005)
    assert np.median(field.whole()) == pytest.approx(0.5, abs=0.06)


def test_contraction_is_that_of_a_list_of_bonds() -> None:
    rng = np.random.default_rng(4)
    bonds = np.triu(rng.normal(size=(30, 30)), 1)
    signs = fine_kernels.contract(bonds + bonds.T)
    pairs = np.argwhere(bonds)
    plain = _agreement(pairs, bonds[bonds != 0])
    assert np.array_equal(signs * signs[0], plain * plain[0])


def test_climbing_gains_until_nothing_does() -> None:
    rng = np.random.default_rng(5)
    bonds = np.triu(rng.normal(size=(30, 30)), 1)
    bonds += bonds.T
    signs = np.ones(30)
    fine_kernels.climb(bonds, signs)
    assert signs @ bonds @ signs > bonds.sum()
    assert (signs * (bonds @ signs))[:-1].min() > -1e-6
    assert signs[-1] == 1


def test_two_sheets_are_told_from_one() -> None:
    rng = np.random.default_rng(6)
    grid = np.mgrid[-1:1:12j, -1:1:12j].reshape(2, -1)
    x, y = grid + rng.uniform(-0.03, 0.03, grid.shape)
    bent = np.stack([x, y, 0.1 * x * x], axis=1)
    side = np.where(rng.random(len(x)) < 0.5, 1, -1).astype(np.int8)
    near = np.argsort(np.hypot(x - x[:, None], y - y[:, None]), axis=1)[:, :20].astype(np.int32)
    normals = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    for apart, is_two in ((0.02, True), (0.0, False)):
        points = bent + apart * side[:, None] * [0, 0, 1]
        points[:, 2] += rng.normal(0, 0.001, len(x))
        explained, sides = np.zeros(len(x)), np.zeros(near.shape, np.int8)
        sheet_kernels.split_in_sheets(points, normals, near, (0, len(x)), explained, sides)
        least, sure = fine_sides._TWO_SHEETS
        assert (explained.mean() > least) == is_two
        if is_two:
            clear = explained > sure
            assert clear.sum() > 40
            assert np.mean(sides[clear] == side[near[clear]]) > 0.97


def test_planes_on_something_thin_go_through_the_points_of_one_side() -> None:
    """Two sheets 0.3 spacings apart, whose normals lean as planes through both sides do."""
    rng = np.random.default_rng(7)
    x, y = rng.uniform(-1, 1, (2, 800))
    side = np.where(rng.random(800) < 0.5, 1.0, -1.0)
    points = np.stack([x, y, 0.01 * side], axis=1)
    leaning = np.tile(np.array([np.sin(0.7), 0, np.cos(0.7)]), (800, 1)) * side[:, None]
    near = np.argsort(np.linalg.norm(points[:, None] - points, axis=2), axis=1)[:, :20].astype(np.int32)
    fitted = fine_sides.one_sided_normals(points, leaning.astype(np.float32), near)
    assert np.mean(fitted[:, 2] * side > 0.999) > 0.95
    one_sheet = points * [1, 1, 0]
    same = np.tile(np.float32([0.6, 0, 0.8]), (800, 1))
    assert np.array_equal(fine_sides.one_sided_normals(one_sheet, same, near), same)


def test_normals_that_lean_to_the_wrong_side_follow_the_winding_number() -> None:
    points, truth = lens(1500, 1.0)
    near = np.argsort(np.linalg.norm(points[:, None] - points, axis=2), axis=1)[:, :20].astype(np.int32)
    normals = truth.astype(np.float32)
    assert np.array_equal(fine_sides.steered_normals(points, normals, near, 9), normals)
    across = np.cross(truth[::50], [0.6, 0.8, 0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    normals[::50] = across * np.cos(0.3) - truth[::50] * np.sin(0.3)
    steered = fine_sides.steered_normals(points, normals, near, 9)
    assert np.linalg.norm(steered, axis=1) == pytest.approx(1, abs=1e-5)
    assert np.mean(np.einsum("ij,ij->i", steered, truth) > np.cos(np.radians(20))) > 0.99
    assert np.einsum("ij,ij->i", steered, truth).min() > 0


def test_normals_on_two_flat_sides_stay() -> None:
    rng = np.random.default_rng(7)
    side = np.where(rng.random(800) < 0.5, 1.0, -1.0)
    points = np.column_stack([*rng.uniform(-1, 1, (2, 800)), 0.01 * side])
    normals = np.column_stack([np.zeros((800, 2)), side]).astype(np.float32)
    near = np.argsort(np.linalg.norm(points[:, None] - points, axis=2), axis=1)[:, :20].astype(np.int32)
    assert np.array_equal(fine_sides.steered_normals(points, normals, near, 9), normals)


def test_normals_of_a_tube_point_out() -> None:
    """Its radius is the distance between its points, so that neighbours lie on all sides of it."""
    rng = np.random.default_rng(0)
    turn, along = rng.uniform(0, 2 * np.pi, 600), rng.uniform(0, 600 / (2 * np.pi), 600)
    truth = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(600)])
    assert flipped(truth + along[:, None] * [0, 0, 1], truth, "fine") < 0.005


@pytest.mark.slow
@pytest.mark.parametrize(("folder", "least"), [("horse_gallop_48", 0.002), ("crane_175", 0.0)])
def test_fine_sides_of_moving_bodies_are_never_worse(data_dir: Path, folder: str, least: float) -> None:
    from open3d import io, utility

    path = data_dir / "sequences" / folder
    points = open_scan(path / "frames").pose(0).cloud.world()
    mesh = io.read_triangle_mesh(str(path / "mesh_topology.ply"))
    mesh.vertices = utility.Vector3dVector(points)
    mesh.compute_vertex_normals()
    truth = np.asarray(mesh.vertex_normals)
    assert flipped(points, truth, "fine") <= flipped(points, truth, "quick") - least


def test_of_many_patches_the_largest_count() -> None:
    """Pairs of all patches take memory and time by the square of their number."""
    patch = np.repeat(np.arange(5, dtype=np.int32), [3, 1, 4, 1, 2])
    np.testing.assert_array_equal(fine_sides._largest(patch, 5)[0], patch)
    few, count = fine_sides._largest(patch, 3)
    assert count == 3
    np.testing.assert_array_equal(few, np.repeat([1, 3, 0, 3, 2], [3, 1, 4, 1, 2]))
