"""Patches of points within which links make normals agree; see `sides`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_FIRM = 0.3  # weight of links within patches, at least
_LEVELS = 255  # of weights that differ


def joined_things(
    links: NDArray[np.int32],
    weights: NDArray[np.floating],
    sizes: NDArray[np.int32],
    most: int,
    anew: bool,
) -> tuple[NDArray[np.int32], NDArray[np.int8]]:
    """The patch of each thing, (N,), from 0, and signs that make the things of a patch agree, (N,); by
    links in the order of their weights. sizes: (N,), points of each thing. most: points of a patch. anew:
    whether links below 0 join things with opposite signs; else only those above 0 join."""
    from . import side_kernels

    strength = np.abs(weights) if anew else weights
    firm = np.flatnonzero(strength >= _FIRM)
    levels = (_LEVELS * (1 - strength[firm] / strength.max(initial=1))).astype(np.uint8)
    order = firm[np.argsort(levels, kind="stable")]
    joined, agreeing = np.empty(len(sizes), np.int32), np.empty(len(sizes), np.int8)
    side_kernels.join(links, weights, order, most, sizes.copy(), joined, agreeing)
    return joined, agreeing


def patches_of(
    links: NDArray[np.int32], weights: NDArray[np.floating], count: int, sizes: tuple[int, ...]
) -> tuple[NDArray[np.int32], NDArray[np.int8]]:
    """The patch of each of `count` points, (N,), from 0, and signs that make points of a patch agree, (N,).

    links: (L, 2). weights: (L,). sizes: points at most of patches, of patches of these, and so on.
    """
    patch, agreeing = np.arange(count, dtype=np.int32), np.ones(count, np.int8)
    points = np.ones(count, np.int32)
    for most in sizes:
        joined, signs = joined_things(links, weights, points, most, anew=True)
        patch, agreeing = joined[patch], agreeing * signs[patch]
        points = np.bincount(joined, points).astype(np.int32)
        links, weights = summed(joined[links], weights * signs[links].prod(axis=1), len(points))
    return patch, agreeing


def summed(
    links: NDArray[np.int32], weights: NDArray[np.floating], count: int
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Links (L, 2) between different ones of `count` things, each pair once, (P, 2), and their sums, (P,)."""
    across = np.flatnonzero(links[:, 0] != links[:, 1])
    keys = np.sort(links[across], axis=1).astype(np.int64) @ np.array([count, 1])
    pairs, pair_of = np.unique(keys, return_inverse=True)
    summed = np.bincount(pair_of, weights[across], len(pairs)).astype(np.float64)
    return np.column_stack(np.divmod(pairs, count)).astype(np.int32), summed
