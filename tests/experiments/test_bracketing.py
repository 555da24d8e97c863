"""The search of Preiner 2012 finds the neighbourhoods that `auto_splats` finds, in as many iterations as the
paper needs."""

from __future__ import annotations

import numpy as np
import pytest
from experiments.preiner_2012.bracketing import bracketed, counts_by_splats, counts_by_tree, initial_radii
from numpy.typing import NDArray
from scenes import sphere
from scipy.spatial import cKDTree

import viewer
from viewer.analysis.visible_normals import NormalSearch, VisibleNormals
from viewer.camera import Camera
from viewer.scan.points import PointCloud
from viewer.view import View

pytestmark = pytest.mark.backend("auto_splats")
K = 10


class Seen:
    """What a camera sees of points, and the neighbourhoods that the shaders find among what it sees."""

    def __init__(self, cloud: PointCloud, size: tuple[int, int]) -> None:
        camera = Camera.orbit(cloud.bounds(), 20, 15, aspect=size[0] / size[1])
        search = NormalSearch(K, adaptive=False, hidden_neighbors=False)
        self.found: VisibleNormals = viewer.estimate_normals(cloud, camera, size=size, search=search)
        self.view = View.of(camera, size, cloud.origin, cloud.bounds())
        self.points: NDArray[np.float64] = cloud.positions[self.found.rows].astype(np.float64)


@pytest.fixture(scope="module")
def seen() -> Seen:
    return Seen(sphere(6000), (160, 120))


def test_the_shaders_find_the_neighborhoods_of_the_paper(seen: Seen) -> None:
    paper = bracketed(initial_radii(seen.view, seen.points, K), K, counts_by_tree(seen.points))
    full = (paper.counts == K) & (seen.found.counts == K)
    assert full.mean() > 0.98
    distances, _ = cKDTree(seen.points).query(seen.points, K + 1)
    rounding = 1 + 4e-6
    # A radius that holds k points lies between the k-th point, which bounds the shaders' ball, and the next.
    assert (seen.found.radii[full] <= rounding * paper.radii[full]).all()
    assert (paper.radii[full] <= distances[full, K]).all()
    np.testing.assert_allclose(seen.found.radii[full], distances[full, K - 1], rtol=4e-6)


def test_most_points_converge_in_ten_iterations(seen: Seen) -> None:
    left = bracketed(initial_radii(seen.view, seen.points, K), K, counts_by_tree(seen.points)).left
    assert left == sorted(left, reverse=True)
    assert left[0] == len(seen.points)
    after = [*left[1:], 0]
    assert min(number for number, count in enumerate(after, 1) if count <= 0.001 * left[0]) <= 10


def test_splats_reach_all_points_of_a_ball_and_no_others(seen: Seen) -> None:
    rows = np.arange(0, len(seen.points), 7)
    radii = np.random.default_rng(0).uniform(0.3, 2.0, len(rows)) * seen.found.radii[rows]
    by_splats = counts_by_splats(seen.view, seen.points)(rows, radii)
    np.testing.assert_array_equal(by_splats, counts_by_tree(seen.points)(rows, radii))


def test_groups_end_before_gaps_and_strays_are_outliers() -> None:
    rng = np.random.default_rng(1)
    group = rng.uniform(0, 1, (5, 3))
    block = rng.uniform((0, 1000, 0), (10, 1010, 10), (400, 3))
    points = np.concatenate([group, [[100.0, 0, 0]], block])
    found = bracketed(np.full(len(points), 1.0), K, counts_by_tree(points))
    assert (found.counts[:5] == 5).all()
    assert np.isnan(found.radii[5])
    assert (found.counts[6:] == K).all()
