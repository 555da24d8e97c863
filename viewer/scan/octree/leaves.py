"""The leaves of an octree as points."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..points import PointCloud, choose_origin
from .discs import MIDDLE
from .octree import Octree
from .stored import with_discs

_SAMPLE = 1 << 13  # leaves that the origin is chosen by


def leaf_points(octree: Octree, means: bool = True) -> PointCloud:
    """A point for each leaf, with its colour and normal, by level and then by Morton code.

    It lies where the surface is in the leaf if `means`, where the tree's attributes tell, else in its middle.
    Radii are of discs there, see `discs_of`.
    """
    leaves: dict[int, NDArray[np.bool_] | slice] = {
        level: masks == 0 for level, masks in enumerate(octree.masks) if not masks.all()
    }
    leaves[octree.depth] = slice(None)  # without a copy

    def joined(parts: Iterator[NDArray]) -> NDArray:
        return np.concatenate([*parts]) if len(leaves) > 1 else next(parts)

    def of_leaves(name: str) -> NDArray | None:
        if not octree.attributes or getattr(octree.attributes[0], name) is None:
            return None
        return joined(getattr(octree.attributes[level], name)[those] for level, those in leaves.items())

    offsets, radii = of_leaves("offsets") if means else None, of_leaves("radii")
    if radii is None:
        octree = with_discs(octree)
        radii = of_leaves("radii")
    codes = {level: octree.codes(level)[those] for level, those in leaves.items()}
    step = max(1, sum(map(len, codes.values())) // _SAMPLE)
    origin = choose_origin(
        np.concatenate([octree.centers_of(some[::step], level) for level, some in codes.items()])
    )
    positions = joined(octree.centers_of(some, level, origin) for level, some in codes.items())
    if offsets is not None:
        sizes = np.repeat([octree.size(level) for level in codes], [len(some) for some in codes.values()])
        for axis in range(3):  # column by column: numpy is slow along the short axis
            positions[:, axis] += (offsets[:, axis] - (MIDDLE - 0.5)) * (sizes / (2 * MIDDLE))
    cloud = PointCloud.from_arrays(
        positions,
        normals=of_leaves("normals"),
        colors=of_leaves("colors"),
        radii=radii,
        origin=np.zeros(3),
        precise=False,
    )
    return replace(cloud, origin=origin)
