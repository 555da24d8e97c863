"""The search of Preiner 2012 for the k nearest neighbours, plain, in float64: what `auto_splats` is compared
with. It finds the k-radius of each point by counting neighbours within radii between two bounds (5.2).

The paper counts by splats: each point draws a square that covers its ball, and so reaches the points within
the ball (4). `counts_by_splats` does the same, and `counts_by_tree` counts the same points faster.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from experiments.suite import row_of
from experiments.tables import Row
from viewer.analysis.visible_normals import NormalSearch, estimate_normals
from viewer.bench.plan import Group
from viewer.bench.run import Bench
from viewer.camera import Camera
from viewer.view import View

Floats = NDArray[np.float64]
Counter = Callable[[NDArray[np.intp], Floats], NDArray[np.intp]]  # points (Q,), radii (Q,) -> counts (Q,)

SCENES = ("bunny", "igea", "dragon")
K = 10
SAMPLES = 4  # counts between two bounds in one iteration
_MOST = 60  # iterations
_TIE = 1e-12  # of a radius: bounds as near as this hold several points as far as each other


class Bracketed(NamedTuple):
    """radii: (N,), a radius that holds exactly k points or, before a gap, all of the group; NaN of outliers.
    counts: (N,), points within them, the point itself among them. left: points that were not converged before
    each iteration."""

    radii: Floats
    counts: NDArray[np.intp]
    left: list[int]


def initial_radii(view: View, points: Floats, k: int) -> Floats:
    """The radius that should hold k points, by how many points share a cell of a grid over the picture (5.1),
    (N,). The cells hold k points on average. points: (N, 3), of which each covers a pixel."""
    width, height = view.size
    side = max(np.sqrt(k * width * height / len(points)), 1.0)
    pixels, depth = view.project(points)
    column, row = np.floor(pixels / side).astype(np.intp).T
    cell = row * (int(width / side) + 1) + column
    in_cell = np.bincount(cell)[cell]
    on_screen = np.sqrt(side * side * k / (np.pi * in_cell))
    return np.asarray(on_screen * view.footprint(depth), np.float64)


def counts_by_tree(points: Floats) -> Counter:
    """Count points within radii by a k-d tree."""
    tree = cKDTree(points)

    def count(rows: NDArray[np.intp], radii: Floats) -> NDArray[np.intp]:
        return np.asarray(tree.query_ball_point(points[rows], radii, return_length=True), np.intp)

    return count


def counts_by_splats(view: View, points: Floats) -> Counter:
    """Count points within radii as the paper does (4): points distribute their radii to all that their splats
    cover, which send a count back with splats as large as the largest radius that they received."""
    width, height = view.size
    pixels, _ = view.project(points)
    column, row = np.floor(pixels).astype(np.intp).T
    picture = np.full((height, width), -1)
    picture[row, column] = np.arange(len(points))
    cube = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T

    def reached(number: int, radius: float) -> NDArray[np.intp]:
        """The points within a ball, among those of the pixels that the splat around it covers."""
        corners, _ = view.project(points[number] + radius * cube)
        low = np.clip(np.floor(corners.min(axis=0)).astype(np.intp), 0, (width, height))
        high = np.clip(np.floor(corners.max(axis=0)).astype(np.intp) + 1, 0, (width, height))
        found = picture[low[1] : high[1], low[0] : high[0]].ravel()
        found = found[found >= 0]
        return found[np.linalg.norm(points[found] - points[number], axis=1) <= radius]

    def count(rows: NDArray[np.intp], radii: Floats) -> NDArray[np.intp]:
        asked = np.full(len(points), -np.inf)
        asked[rows] = radii
        feedback = np.zeros(len(points))
        for number in rows.tolist():
            near = reached(number, asked[number])
            feedback[near] = np.maximum(feedback[near], asked[number])
        counts = np.zeros(len(points), np.intp)
        for number in np.flatnonzero(feedback).tolist():
            near = reached(number, feedback[number])
            away = np.linalg.norm(points[near] - points[number], axis=1)
            counts[near[away <= asked[near]]] += 1
        return counts[rows]

    return count


def bracketed(start: Floats, k: int, count: Counter, expansions: int = 3, growth: float = 4.0) -> Bracketed:
    """Search the radius that holds k points of each point (5.2, 5.3).

    start: (N,), the first upper bounds. expansions: of a radius without another point, until the point is an
    outlier. growth: of the area that holds some points, within which another must follow.
    """
    low, high = np.zeros(len(start)), start.astype(np.float64).copy()
    at_low = np.zeros(len(start), np.intp)
    reached = high.copy()  # the least radius at which the last neighbour is known to be within
    radii, counts = np.full(len(start), np.nan), np.ones(len(start), np.intp)
    active, left = np.arange(len(start)), []
    for iteration in range(_MOST):
        if not len(active):
            break
        left.append(len(active))
        steps = np.arange(1, SAMPLES + 1) / SAMPLES
        bounds = low[active, None] + steps * (high - low)[active, None]
        samples = np.column_stack([count(active, radius) for radius in bounds.T])
        done = np.zeros(len(active), bool)
        exact = samples == k
        hit = exact.any(axis=1)
        done |= hit
        radii[active[hit]] = bounds[hit, exact[hit].argmax(axis=1)]
        counts[active[hit]] = k
        few = samples[:, -1] < k
        grew = few & (samples[:, -1] > at_low[active])
        reached[active[grew]] = high[active[grew]]
        alone = few & (samples[:, -1] == 1) & (iteration >= expansions)
        closed = few & (samples[:, -1] > 1) & (high[active] ** 2 >= growth * reached[active] ** 2)
        radii[active[closed]], counts[active[closed]] = reached[active[closed]], samples[closed, -1]
        tied = ~few & ~hit & (high[active] - low[active] <= _TIE * high[active])
        radii[active[tied]], counts[active[tied]] = high[active[tied]], samples[tied, -1]
        done |= alone | closed | tied
        wider, narrower = active[few & ~done], ~few & ~done
        low[wider], at_low[wider] = high[wider], samples[few & ~done, -1]
        high[wider] *= np.sqrt(k / samples[few & ~done, -1])
        first = (samples[narrower] > k).argmax(axis=1)
        edges = np.column_stack([low[active[narrower]], bounds[narrower]])
        known = np.column_stack([at_low[active[narrower]], samples[narrower]])
        each, rows = np.arange(len(first)), active[narrower]
        low[rows], high[rows] = edges[each, first], edges[each, first + 1]
        at_low[rows] = known[each, first]
        active = active[~done]
    return Bracketed(radii, counts, left)


def measure_iterations(bench: Bench) -> Iterator[Row]:
    """Yield a row for each scene: how many visible points were not converged before each iteration."""
    size = bench.settings.size
    for scene in SCENES:
        moment = bench.subject(Group(scene, ())).moment(0)
        cloud = moment.pose.cloud
        camera = Camera.orbit(moment.mesh.bounds, 0, 10, aspect=size[0] / size[1])
        search = NormalSearch(K, adaptive=False, hidden_neighbors=False)
        rows = estimate_normals(cloud, camera, size=size, search=search).rows
        points: Floats = cloud.positions[rows].astype(np.float64)
        view = View.of(camera, size, cloud.origin, cloud.bounds())
        found = bracketed(initial_radii(view, points, K), K, counts_by_tree(points))
        yield row_of(bench, scene=scene, n=len(cloud), left=found.left)
