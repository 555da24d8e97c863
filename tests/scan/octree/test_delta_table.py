"""Slomp 2014, Table III: how deep octrees become of scans like the paper's."""

from __future__ import annotations

import numpy as np
import pytest
from experiments.slomp_2014.scans import PAPER
from numpy.typing import NDArray

from viewer.scan.octree.build import Stop, build
from viewer.scan.points import PointCloud

# Someone who runs: both ends of each bone, and its radius, in metres.
BONES = np.array([
    [0, 0.95, 0, 0, 1.45, 0, 0.17], [0, 1.6, 0, 0, 1.68, 0, 0.11],
    [-0.1, 0.9, 0, -0.16, 0.5, 0.1, 0.085], [-0.16, 0.5, 0.1, -0.2, 0.08, -0.05, 0.06],
    [0.1, 0.9, 0, 0.3, 0.6, 0.25, 0.085], [0.3, 0.6, 0.25, 0.3, 0.2, 0.1, 0.06],
    [-0.2, 1.4, 0, -0.45, 1.15, 0.1, 0.055], [-0.45, 1.15, 0.1, -0.6, 1.35, 0.3, 0.045],
    [0.2, 1.4, 0, 0.45, 1.2, -0.1, 0.055], [0.45, 1.2, -0.1, 0.6, 1.0, -0.3, 0.045],
])  # fmt: skip


def figure(count: int) -> NDArray[np.float64]:
    """Points on capsules around the bones, by chance."""
    rng = np.random.default_rng(0)
    start, radius = BONES[:, :3], BONES[:, 6]
    along = BONES[:, 3:6] - start
    length = np.linalg.norm(along, axis=1)
    area = radius * (length + 2 * radius)
    bone = rng.choice(len(BONES), count, p=area / area.sum())
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    axis = (along / length[:, None])[bone]
    rise = (direction * axis).sum(axis=1)
    side = rng.random(count) < (length / (length + 2 * radius))[bone]
    across = direction - rise[:, None] * axis
    across /= np.linalg.norm(across, axis=1)[:, None]
    share = np.where(side, rng.random(count), rise > 0)
    outward = np.where(side[:, None], across, direction)
    return start[bone] + share[:, None] * along[bone] + radius[bone][:, None] * outward


@pytest.mark.parametrize("name", PAPER["octrees"])
def test_depths_follow_the_papers_pattern(name: str) -> None:
    cloud = PointCloud.from_arrays(figure(PAPER["datasets"][name]["points"]))
    trees = {}
    for row in PAPER["octrees"][name]:
        delta = row["delta_percent"] / 100
        tree = trees[delta] = build(cloud, Stop(delta=delta), attributes=False)
        assert abs(tree.depth - row["depth"]) <= 1
        assert tree.loss <= delta
    assert trees[0.02].depth > trees[0.1].depth > trees[0.5].depth
    # The inner nodes of a deeper tree are all the nodes of the one above it, as in the paper.
    fine, coarse = trees[0.02], trees[0.1]
    assert fine.depth == coarse.depth + 1
    assert fine.counts[:-1].sum() == coarse.counts.sum()
