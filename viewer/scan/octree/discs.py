"""The nodes of an octree as pieces of a surface: where each lies on the mean, and how large a disc there has
to be to close the surface.

A leaf whose points store radii has the largest of them, where that is at least the distance between leaves.
Elsewhere the leaves say how dense the surface is sampled around each of them. The disc of an inner
node covers what the discs below it cover (as the spheres of QSplat do, Rusinkiewicz and Levoy 2000).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..points import strided

MIDDLE = 1 << 15  # an offset: the middle of a cell
_RADIUS_PER_SPACING = 1.25  # closes the surface of a scan: docs/how-it-works/voxels.md
_LARGEST = 4.0  # times the usual radius: leaves seem to lie apart where a cell has but a strip of them


def discs_of(
    masks: Sequence[NDArray[np.uint8]],
    edge: float,
    offsets: Sequence[NDArray[np.uint16]],
    radii: Sequence[NDArray[np.float32]],
    own_radii: Sequence[NDArray[np.float32] | None],
) -> None:
    """Find offsets and radii of all nodes, as `Attributes` has them, from the offsets of the leaves.

    masks: of the levels above the deepest, see `Octree`. edge: of the cube. offsets: of each level, (n, 3);
    those of inner nodes, means over the leaves below, are written. radii: of each level, (n,), are written.
    own_radii: of each level, as `Attributes` has them.
    """
    from . import disc_kernels

    sizes, depth = [len(each) for each in offsets], len(masks)
    leaves = [np.ones(size, np.float32) for size in sizes]
    for each in radii:  # until the end they are something else, see the kernels
        each[:] = 0
    for level in reversed(range(depth)):
        below = offsets[level + 1], leaves[level + 1], radii[level + 1]
        disc_kernels.gather_leaves(masks[level], *below, offsets[level], leaves[level], radii[level])
    disc_kernels.take_root(leaves[0], radii[0])
    for level in range(depth):
        here = leaves[level], radii[level]
        disc_kernels.spread_spacing(masks[level], *here, leaves[level + 1], radii[level + 1])
    are_leaves = [each == 0 for each in masks] + [np.ones(sizes[-1], bool)]
    for level in range(depth + 1):
        radii[level][are_leaves[level]] *= np.float32(_RADIUS_PER_SPACING * edge / 2**level)
    most = _LARGEST * usual_radius(masks, radii)
    for level in range(depth + 1):
        np.minimum(radii[level], np.float32(most), out=radii[level], where=are_leaves[level])
        if (own := own_radii[level]) is not None:
            suffices = are_leaves[level] & (own > 0) & (own * _RADIUS_PER_SPACING >= radii[level])
            np.copyto(radii[level], own, where=suffices)
    for level in reversed(range(depth)):
        around = offsets[level + 1], radii[level + 1], offsets[level]
        disc_kernels.cover(masks[level], *around, edge / 2**level, radii[level])


def usual_radius(masks: Sequence[NDArray[np.uint8]], radii: Sequence[NDArray[np.float32]]) -> float:
    """The median radius of leaves, scan units; 0 where there is none. masks, radii: as for `discs_of`."""
    some = [strided(radii[level][above == 0]) for level, above in enumerate(masks)] + [strided(radii[-1])]
    found = np.concatenate(some)
    return float(np.median(found)) if len(found) else 0.0
