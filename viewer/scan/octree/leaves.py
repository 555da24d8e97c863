"""The leaves of an octree as points, and how large nodes have to be to close a surface."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..points import PointCloud, choose_origin
from .neighbors import Bytes, Neighbors
from .octree import Octree

_SAMPLE = 1 << 13  # leaves that the origin is chosen by
_TOUCHED = 3  # faces of a node, at least, within a surface; an octant cut by a plane has three to six
_MOST_COARSER = 1  # levels, than those of half of the leaves: what lies apart does not become a large disc


def leaf_points(octree: Octree) -> PointCloud:
    """A point in the middle of each leaf, with its colour and normal, by level and then by Morton code.

    Radii are half of the diagonal of the leaf, or of the smallest octant around it that is one of a surface.
    A disc of that size covers whatever section a plane through the middle makes of the octant, so that there
    are no gaps between octants that touch; leaves themselves may be too small to touch.
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

    touching = _touching_levels(octree)
    found = _not_much_coarser(joined(touching[level][those] for level, those in leaves.items())).astype(
        np.int32
    )
    del touching
    codes = {level: octree.codes(level)[those] for level, those in leaves.items()}
    step = max(1, sum(map(len, codes.values())) // _SAMPLE)
    origin = choose_origin(
        np.concatenate([octree.centers_of(some[::step], level) for level, some in codes.items()])
    )
    cloud = PointCloud.from_arrays(
        joined(octree.centers_of(some, level, origin) for level, some in codes.items()),
        normals=of_leaves("normals"),
        colors=of_leaves("colors"),
        radii=np.ldexp(np.float32(math.sqrt(3) / 2 * octree.edge), -found),
        origin=np.zeros(3),
        precise=False,
    )
    return replace(cloud, origin=origin)


def closing_levels(octree: Octree) -> list[Bytes]:
    """Levels for each level, (n,): of the octant around each node that is as large as the gaps beside it:
    nodes that are drawn so large close the surface, however small they are themselves."""
    return [_not_much_coarser(found) for found in _touching_levels(octree)]


def _not_much_coarser(found: NDArray) -> NDArray:
    return np.maximum(found, max(int(np.median(found)) - _MOST_COARSER, 0)) if len(found) else found


def _touching_levels(octree: Octree) -> list[Bytes]:
    """Levels for each level, (n,): the deepest at which a node, or one around it, touches enough others."""
    neighbors = Neighbors(int(octree.counts[0]))
    levels = [np.zeros(int(octree.counts[0]), np.uint8)]
    for number, masks in enumerate(octree.masks, 1):
        if number < octree.depth:
            children = neighbors.descend(masks)
            around = neighbors.around()
        else:
            children, around = neighbors.around_below(masks)
        touches = np.bitwise_count(around) >= _TOUCHED
        levels.append(np.where(touches, np.uint8(number), levels[-1][children.parents]))
    return levels
