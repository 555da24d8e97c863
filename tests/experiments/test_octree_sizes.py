"""What octrees take on disk, and the error that Draco is compared at."""

from __future__ import annotations

import DracoPy
import numpy as np
import pytest
from experiments.slomp_2014 import octree_sizes
from experiments.slomp_2014.octree_sizes import Sizes, d1_psnr

from viewer.scan.octree.build import Stop, build
from viewer.scan.points import PointCloud


@pytest.fixture(scope="module")
def rows() -> list[Sizes]:
    """Of the demo, which needs no data."""
    return list(octree_sizes.measure(None))


def test_the_error_is_the_one_that_is_defined() -> None:
    lattice = np.indices((5, 5, 5)).reshape(3, -1).T.astype(float)
    assert d1_psnr(lattice, lattice) == np.inf
    assert d1_psnr(lattice, lattice + np.array([0.1, 0, 0])) == pytest.approx(10 * np.log10(3 * 4**2 / 0.01))
    half = lattice[lattice[:, 0] < 4]  # 25 of 125 points are 1 away from the nearest, none the other way
    assert d1_psnr(lattice, half) == pytest.approx(10 * np.log10(3 * 4**2 / 0.2))
    assert d1_psnr(half, lattice) == pytest.approx(10 * np.log10(3 * 4**2 / 0.2))


def test_draco_keeps_exactly_the_leaves() -> None:
    """So that the errors of both are equal."""
    cloud = PointCloud.from_arrays(np.random.default_rng(4).random((3000, 3)) * 7 + 100)
    octree = build(cloud, Stop(rule="depth", depth=6))
    decoded = DracoPy.decode(octree_sizes._draco(octree)).points
    cells = np.rint(decoded / octree.size(octree.depth)).astype(int)
    assert np.allclose(decoded, cells * octree.size(octree.depth), atol=1e-5)
    assert {*map(tuple, cells.tolist())} == {*map(tuple, octree.cells(octree.depth).tolist())}
    assert len(cells) == octree.leaves


@pytest.mark.slow
def test_what_is_measured_of_the_demo(rows: list[Sizes]) -> None:
    assert {row.scene for row in rows} == {"demo"}
    assert [row.stop for row in rows] == list(octree_sizes.STOPS)
    for row in rows:
        bits = row.bits
        assert bits["float32"] == 96
        assert bits["chosen"] <= bits["inter"] < bits["intra"] < bits["masks"] < bits["gzip"] < 96
        assert bits["intra"] < bits["draco"]
        assert row.loss == pytest.approx(1 - row.leaves / row.points)
        edge, extent = 1 / 2**row.depth, 1.0
        # positions spread evenly over a leaf are a twelfth of its edge squared away, along each axis
        assert row.psnr == pytest.approx(10 * np.log10(3 * extent / (3 * edge**2 / 12)), abs=1)
