"""Deferred blending, as a contender (Zhang and Pajarola 2007), on the CPU.

Discs are sorted into groups once, so that discs of one group do not overlap. A picture draws each disc once,
each group into a layer of its own with a test of depth, and then blends the layers in each pixel. So no
visibility pass comes first. The paper is not at hand: this follows its abstract. Groups are first fit in the
order of the points, with no limit; weights are Gaussians, and layers blend up to a radius behind the nearest.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from experiments.farooq_2013.pull_push import CELL, CellsBackend, Floats, view_rows
from viewer.errors import InputError
from viewer.view import View


def groups_of(points: Floats) -> NDArray[np.int64]:
    """The group of each disc, (N,). points: (N, 10), see `points_of`. Raises InputError where 64 groups are
    not enough."""
    from scipy.sparse import coo_array
    from scipy.spatial import KDTree

    from experiments.farooq_2013 import deferred_blending_kernels as kernels

    positions, radii = points[:, :3].astype(np.float64), points[:, 9].astype(np.float64)
    found = KDTree(positions).query_ball_point(positions, 2 * radii)  # by the larger of two
    first = np.repeat(np.arange(len(points)), list(map(len, found)))
    second = np.concatenate([np.asarray(each, np.int64) for each in found])
    apart = np.linalg.norm(positions[first] - positions[second], axis=1)
    pairs = (first != second) & (apart < radii[first] + radii[second])
    first, second = first[pairs], second[pairs]
    ones = np.ones(len(first), np.int8)
    overlaps = coo_array((ones, (first, second)), shape=(len(points),) * 2).tocsr()
    overlaps = overlaps + overlaps.T
    groups = np.full(len(points), -1)
    if kernels.assign(overlaps.indptr, overlaps.indices, groups) < 0:
        raise InputError("discs overlap more than 64 groups can part")
    return groups


def blended(points: Floats, groups: NDArray[np.int64], view: View) -> Floats:
    """The cells of a picture, (H, W, 12), see pull_push_kernels.py. groups: see `groups_of`."""
    from experiments.farooq_2013 import deferred_blending_kernels as kernels

    width, height = view.size
    layers = (int(groups.max(initial=-1)) + 1, width * height)
    depths, weights = np.full(layers, np.inf, np.float32), np.empty(layers, np.float32)
    rows, cells = np.empty(layers, np.uint32), np.empty((width * height, CELL), np.float32)
    seen = view_rows(view)
    kernels.draw_layers(points, groups, seen, view.size, depths, weights, rows)
    kernels.blend(points, seen, depths, weights, rows, cells)
    return cells.reshape(height, width, CELL)


def deferred_blending() -> CellsBackend:
    """The contender on the CPU; the GPU shows the cells."""
    return CellsBackend("deferred-blending", lambda points: partial(blended, points, groups_of(points)))
