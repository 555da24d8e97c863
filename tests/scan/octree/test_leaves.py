"""The leaves of octrees as points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import rarely

from viewer.bench.scenes.samples import on_sphere
from viewer.scan.octree.build import Stop, build
from viewer.scan.octree.leaves import leaf_points
from viewer.scan.octree.octree import Octree
from viewer.scan.points import PointCloud


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
def test_a_leaf_lies_at_the_mean_of_its_points(stop: Stop, offset: float) -> None:
    cloud = PointCloud.from_arrays(np.random.default_rng(5).random((400, 3)) ** 2 + offset)
    octree = build(cloud, stop)
    leaves, edges = leaf_points(octree), leaf_edges(octree)
    centers = leaf_points(replace(octree, attributes=()))
    assert len(leaves) == octree.leaves
    rows = inside(cloud, centers, octree)
    assert (rows.sum(axis=1) == 1).all()
    assert rows.any(axis=0).all()
    means = (rows.T @ (cloud.world() - offset)) / rows.sum(axis=0)[:, None]
    away = np.abs(leaves.world() - offset - means).max(axis=1)
    assert (away <= 2e-5 * edges + 1e-9 * offset).all()
    assert (leaves.radii > 0).all() == (len(leaves) > 1), "one alone tells no spacing"


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
    leaf_of = inside(cloud, leaf_points(replace(octree, attributes=())), octree).argmax(axis=1)
    assert np.array_equal(leaves.colors[leaf_of], cloud.colors)
    assert np.allclose(leaves.normals[leaf_of], cloud.normals, atol=1e-3)


@pytest.mark.parametrize("attributes", [True, False])
@pytest.mark.parametrize("stop", [Stop(), *rarely(Stop(delta=0.0), Stop(rule="depth", depth=5))])
@pytest.mark.slow
def test_discs_close_a_surface_however_small_its_leaves_are(stop: Stop, attributes: bool) -> None:
    cloud = replace(PointCloud.from_arrays(**on_sphere(6000)), radii=None)
    leaves = leaf_points(build(cloud, stop, attributes=attributes))
    places = sphere(2000, seed=9).world()
    distances = np.linalg.norm(places[:, None] - leaves.world(), axis=2)
    assert (distances < leaves.radii).any(axis=1).mean() > 0.999
    assert (distances < 0.4 * leaves.radii).any(axis=1).mean() < 0.9, "no larger than need be"


def test_the_disc_of_a_node_covers_those_below() -> None:
    octree = build(sphere(3000), Stop(rule="occupancy", occupancy=2))
    found = octree.attributes
    places = [
        octree.centers(level) + (own.offsets - 32767.5) / 65536 * octree.size(level)
        for level, own in enumerate(found)
    ]
    for level, masks in enumerate(octree.masks):
        children = np.repeat(np.arange(len(masks)), np.bitwise_count(masks))
        apart = np.linalg.norm(places[level + 1] - places[level][children], axis=1)
        reach = apart + found[level + 1].radii
        assert (found[level].radii[children] >= reach - 1e-4 * octree.size(level)).all()
        largest = np.zeros(len(masks), np.float32)
        np.maximum.at(largest, children, reach)
        inner = masks > 0
        np.testing.assert_allclose(found[level].radii[inner], largest[inner], rtol=1e-3)


def test_discs_are_as_large_as_points_lie_apart_there() -> None:
    """A sheet of which one half has ten times the points of the other; apart from the border."""
    rng = np.random.default_rng(1)

    def sheet(count: int) -> NDArray[np.float64]:
        grid = np.stack(np.meshgrid(*[(np.arange(count) + 0.5) / count] * 2), axis=-1).reshape(-1, 2)
        return grid + rng.uniform(-0.1, 0.1, grid.shape) / count

    dense, sparse = sheet(95), np.add(sheet(30), [1, 0])
    points = np.concatenate([dense, sparse])
    leaves = leaf_points(build(PointCloud.from_arrays(np.c_[points, 0 * points[:, 0]])))
    x = leaves.world()[:, 0]
    for there, spacing in ((x < 0.9, 1 / 95), (x > 1.1, 1 / 30)):
        shares = leaves.radii[there] / spacing
        assert 1.1 < np.median(shares) < 1.5
        assert shares.min() > 0.7
        assert np.quantile(shares, 0.99) < 2


def test_what_lies_apart_does_not_become_a_large_disc() -> None:
    points = np.concatenate([sphere(5000).world(), [[1.4, 1.4, 1.4], [0, 0, 0]]])
    octree = build(PointCloud.from_arrays(points))
    assert not len(octree.strays)
    radii = leaf_points(octree).radii
    assert radii.max() <= 5 * np.median(radii)


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
