"""Octrees that files store, to be drawn as they are: not built again from the points of their leaves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..points import PointCloud
from .discs import MIDDLE, discs_of
from .octree import Attributes, Octree


@dataclass(frozen=True, eq=False)
class StoredOctree:
    """An octree whose leaves, and strays behind them, are points with these positions and this origin.

    Any change of the positions makes other points, whose octree it is not.
    """

    octree: Octree
    positions: NDArray[np.float32]
    origin: NDArray[np.float64]

    @property
    def nbytes(self) -> int:
        """Bytes that the octree holds."""
        return self.octree.nbytes


def with_discs(octree: Octree, strays: int = 0) -> Octree:
    """The octree with what drawing needs and files do not store: rows of leaves, offsets and radii of discs.

    Rows are those of `leaf_points`. Where the tree has no offsets, a leaf has the middle of its cell. strays:
    how many points follow the leaves, which lie outside the cube.
    """
    counts = octree.counts.tolist()
    offsets = [np.full((count, 3), MIDDLE, np.uint16) for count in counts]
    radii = [np.empty(count, np.float32) for count in counts]
    own = octree.attributes or (Attributes(),) * len(counts)
    for offset, each in zip(offsets, own, strict=True):
        if each.offsets is not None and len(each.offsets):
            offset[:] = each.offsets
    discs_of(octree.masks, octree.edge, offsets, radii, [each.own_radii for each in own])
    attributes = tuple(
        replace(each, rows=of_row, offsets=offset, radii=radius)
        for each, of_row, offset, radius in zip(own, _rows(octree), offsets, radii, strict=True)
    )
    outside = np.arange(octree.leaves, octree.leaves + strays, dtype=np.uint32)
    return replace(octree, attributes=attributes, strays=outside)


def without_own_radii(octree: Octree) -> Octree:
    """The octree of `with_discs`, its discs as large as the distances between leaves alone tell."""
    bare = replace(octree, attributes=tuple(replace(each, own_radii=None) for each in octree.attributes))
    return replace(with_discs(bare), strays=octree.strays)


def octree_of(cloud: PointCloud) -> Octree | None:
    """The octree that a file stores of these very points, with their normals; None where there is none."""
    stored = cloud.octree
    if not isinstance(stored, StoredOctree) or not np.array_equal(stored.origin, cloud.origin):
        return None
    if not (stored.positions is cloud.positions or np.array_equal(stored.positions, cloud.positions)):
        return None
    octree = stored.octree
    if cloud.normals is None or _has_normals(octree, cloud.normals):
        return octree
    return _with_normals(octree, cloud.normals)


def _rows(octree: Octree) -> list[NDArray[np.uint32]]:
    """The lowest leaf below each node, level by level, in the order of `leaf_points`."""
    are_leaves = [each == 0 for each in octree.masks] + [np.ones(int(octree.counts[-1]), bool)]
    first = np.concatenate([[0], np.cumsum([np.count_nonzero(each) for each in are_leaves])])
    rows = [np.empty(len(each), np.uint32) for each in are_leaves]
    for level in reversed(range(octree.depth + 1)):
        own = are_leaves[level]
        rows[level][own] = np.arange(first[level], first[level + 1], dtype=np.uint32)
        if level < octree.depth and not own.all():
            starts = octree.first_child[level][~own].astype(np.intp)
            rows[level][~own] = np.minimum.reduceat(rows[level + 1], starts)
    return rows


def _leaf_normals(octree: Octree) -> NDArray[np.float32] | None:
    own = [each.normals for each in octree.attributes]
    if any(each is None for each in own):
        return None
    inner = [each[masks == 0] for each, masks in zip(own, octree.masks, strict=False) if each is not None]
    return np.concatenate([*inner, own[-1]])


def _has_normals(octree: Octree, normals: NDArray[np.float32]) -> bool:
    own = _leaf_normals(octree)
    return own is not None and np.array_equal(own, normals[: octree.leaves])


def _with_normals(octree: Octree, normals: NDArray[np.float32]) -> Octree:
    """The octree with means of these normals of its leaves; longer sums where more leaves agree."""
    sums = [np.zeros((int(count), 3)) for count in octree.counts]
    first = 0
    for level, each in enumerate(sums):
        own = octree.masks[level] == 0 if level < octree.depth else np.ones(len(each), bool)
        count = int(np.count_nonzero(own))
        each[own] = normals[first : first + count]
        first += count
    for level in reversed(range(octree.depth)):
        inner = np.flatnonzero(octree.masks[level])
        starts = octree.first_child[level][inner].astype(np.intp)
        if len(inner):
            sums[level][inner] = np.add.reduceat(sums[level + 1], starts, axis=0)
    attributes = tuple(
        replace(each, normals=_units(total)) for each, total in zip(octree.attributes, sums, strict=True)
    )
    return replace(octree, attributes=attributes)


def _units(sums: NDArray[np.float64]) -> NDArray[np.float32]:
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.divide(sums, lengths, out=np.zeros_like(sums), where=lengths > 0).astype(np.float32)
