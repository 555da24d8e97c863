"""The leaves of an octree as points, and how large nodes have to be to close a surface."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..points import PointCloud
from .neighbors import Bytes, Neighbors
from .octree import Octree

_TOUCHED = 3  # faces of a node, at least, within a surface; an octant cut by a plane has three to six
_MOST_COARSER = 1  # levels, than those of half of the leaves: what lies apart does not become a large disc


def leaf_points(octree: Octree) -> PointCloud:
    """A point in the middle of each leaf, with its colour and normal, by level and then by Morton code.

    Radii are half of the diagonal of the leaf, or of the smallest octant around it that is one of a surface.
    A disc of that size covers whatever section a plane through the middle makes of the octant, so that there
    are no gaps between octants that touch; leaves themselves may be too small to touch.
    """
    leaves = [octree.masks[level] == 0 for level in range(octree.depth)]
    leaves.append(np.ones(int(octree.counts[-1]), bool))
    levels = [level for level in range(octree.depth + 1) if leaves[level].any()] or [0]

    def of_leaves(name: str) -> NDArray | None:
        if not octree.attributes or getattr(octree.attributes[0], name) is None:
            return None
        return np.concatenate([getattr(octree.attributes[level], name)[leaves[level]] for level in levels])

    touching = _touching_levels(octree)
    found = np.concatenate([touching[level][leaves[level]] for level in levels]).astype(np.int32)
    found = _not_much_coarser(found)
    return PointCloud.from_arrays(
        np.concatenate([octree.centers(level)[leaves[level]] for level in levels]),
        normals=of_leaves("normals"),
        colors=of_leaves("colors"),
        radii=np.ldexp(math.sqrt(3) / 2 * octree.edge, -found),
    )


def closing_levels(octree: Octree) -> list[Bytes]:
    """For each level, (n,): the level of the octant around each node that is as large as the gaps beside it:
    nodes that are drawn so large close the surface, however small they are themselves."""
    return [_not_much_coarser(found) for found in _touching_levels(octree)]


def _not_much_coarser(found: NDArray) -> NDArray:
    return np.maximum(found, max(int(np.median(found)) - _MOST_COARSER, 0)) if len(found) else found


def _touching_levels(octree: Octree) -> list[Bytes]:
    """For each level, (n,): the deepest level at which a node, or one around it, touches enough others."""
    neighbors = Neighbors(int(octree.counts[0]))
    levels = [np.zeros(int(octree.counts[0]), np.uint8)]
    for number, masks in enumerate(octree.masks, 1):
        children = neighbors.descend(masks)
        touches = np.bitwise_count(neighbors.around()) >= _TOUCHED
        levels.append(np.where(touches, np.uint8(number), levels[-1][children.parents]))
    return levels
