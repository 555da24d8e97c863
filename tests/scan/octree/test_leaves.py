"""The leaves of octrees as points."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.scan.octree.build import Stop, build
from viewer.scan.octree.leaves import leaf_points
from viewer.scan.octree.neighbors import Neighbors
from viewer.scan.octree.octree import Octree
from viewer.scan.points import PointCloud

HALF_DIAGONAL = np.sqrt(3) / 2


def leaf_edges(octree: Octree) -> NDArray[np.float64]:
    """(M,): the edge of each leaf, by level."""
    counts = [np.count_nonzero(masks == 0) for masks in octree.masks] + [octree.counts[-1]]
    return np.repeat([octree.size(level) for level in range(octree.depth + 1)], counts)


def inside(cloud: PointCloud, leaves: PointCloud, octree: Octree) -> NDArray[np.bool_]:
    """(N, M): which points are in which leaves."""
    offsets = np.abs(cloud.world()[:, None] - leaves.world()).max(axis=2)
    return offsets <= leaf_edges(octree) / 2 * (1 + 1e-6)


def sphere(count: int, seed: int = 3) -> PointCloud:
    normals = np.random.default_rng(seed).normal(size=(count, 3))
    return PointCloud.from_arrays(normals / np.linalg.norm(normals, axis=1, keepdims=True))


@pytest.mark.parametrize("stop", [Stop(), Stop(rule="occupancy", occupancy=5), Stop(rule="depth", depth=0)])
@pytest.mark.parametrize("offset", [0.0, 5.6e6])
def test_every_point_is_in_one_leaf_and_within_its_radius(stop: Stop, offset: float) -> None:
    cloud = PointCloud.from_arrays(np.random.default_rng(5).random((400, 3)) ** 2 + offset)
    octree = build(cloud, stop)
    leaves = leaf_points(octree)
    assert len(leaves) == octree.leaves
    rows = inside(cloud, leaves, octree)
    assert (rows.sum(axis=1) == 1).all()
    assert rows.any(axis=0).all()
    assert (leaves.radii >= np.float32(HALF_DIAGONAL) * leaf_edges(octree) * (1 - 1e-6)).all()
    distances = np.linalg.norm(cloud.world() - leaves.world()[rows.argmax(axis=1)], axis=1)
    assert (distances <= leaves.radii[rows.argmax(axis=1)] * (1 + 1e-6)).all()


def test_each_leaf_has_its_own_attributes() -> None:
    """Where every point has a leaf of its own, at whatever level, that has the point's colour and normal."""
    rng = np.random.default_rng(6)
    normals = rng.normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    colors = rng.integers(0, 256, (200, 4), np.uint8)
    cloud = PointCloud.from_arrays(rng.random((200, 3)), normals=normals, colors=colors)
    octree = build(cloud, Stop(rule="occupancy", occupancy=1))
    leaves = leaf_points(octree)
    assert len(leaves) == len(cloud)
    assert len({*leaf_edges(octree)}) > 1
    leaf_of = inside(cloud, leaves, octree).argmax(axis=1)
    assert np.array_equal(leaves.colors[leaf_of], cloud.colors)
    assert np.allclose(leaves.normals[leaf_of], cloud.normals, atol=1e-3)


def test_radii_are_of_the_smallest_octant_around_that_touches_three_others() -> None:
    """Found again by climbing from each leaf; but one level coarser than half of the leaves at most."""
    octree = build(sphere(1500), Stop(rule="depth", depth=7))
    there = [{*map(tuple, octree.cells(level).tolist())} for level in range(octree.depth + 1)]

    def touches(level: int, cell: tuple[int, ...]) -> bool:
        sides = (np.add(cell, step) for step in [*np.eye(3, dtype=int), *-np.eye(3, dtype=int)])
        return sum(tuple(side.tolist()) in there[level] for side in sides) >= 3

    found = []
    for cell in map(tuple, octree.cells(octree.depth).tolist()):
        level = octree.depth
        while level and not touches(level, cell):
            level, cell = level - 1, tuple(each >> 1 for each in cell)
        found.append(level)
    found = np.maximum(found, np.median(found).astype(int) - 1)
    assert len({*found}) > 1
    expected = HALF_DIAGONAL * octree.edge / 2.0**found
    assert np.allclose(leaf_points(octree).radii, expected)


@pytest.mark.parametrize("stop", [Stop(), Stop(delta=0.0), Stop(rule="depth", depth=5)])
def test_discs_close_a_surface_however_small_its_leaves_are(stop: Stop) -> None:
    octree = build(sphere(6000), stop)
    leaves = leaf_points(octree)
    places = sphere(1000, seed=9).world()
    distances = np.linalg.norm(places[:, None] - leaves.world(), axis=2)
    covered = (distances < leaves.radii).any(axis=1).mean()
    assert covered > 0.995  # points at random leave some places bare
    alone = (distances < HALF_DIAGONAL * octree.size(octree.depth)).any(axis=1).mean()
    assert (alone < 0.8) == (stop.rule == "delta")


def test_what_lies_apart_does_not_become_a_large_disc() -> None:
    points = np.concatenate([sphere(5000).world(), [[9, 9, 9]]])
    radii = leaf_points(build(PointCloud.from_arrays(points))).radii
    assert radii.max() <= 2 * np.median(radii)


def test_a_tree_without_points_has_no_leaves() -> None:
    assert len(leaf_points(build(PointCloud.from_arrays(np.empty((0, 3)))))) == 0


def test_centers_of_some_nodes_are_those_of_all() -> None:
    points = np.random.default_rng(5).normal((665187.5, 5648349.25, 241.5), size=(200_000, 3))
    octree = build(PointCloud.from_arrays(points), Stop("occupancy", occupancy=2))
    for level in (0, 3, octree.depth):
        centers = octree.centers(level)
        np.testing.assert_array_equal(centers, octree.low + (octree.cells(level) + 0.5) * octree.size(level))
        origin = octree.low + 0.25
        near = octree.centers_of(octree.codes(level)[::3], level, origin)
        assert near.dtype == np.float32
        np.testing.assert_array_equal(near, (centers[::3] - origin).astype(np.float32))


def test_what_is_around_below_is_what_is_around_there() -> None:
    octree = build(PointCloud.from_arrays(np.random.default_rng(5).normal(size=(100_000, 3))))
    neighbors = Neighbors(1)
    for masks in octree.masks:
        _, around = neighbors.around_below(masks)
        neighbors.descend(masks)
        np.testing.assert_array_equal(around, neighbors.around())
