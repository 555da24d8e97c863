"""Faces made such that a walk over them is told at every edge: oriented alike, two an edge, a fan a
vertex."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.int64]


def manifold(faces: NDArray[np.integer]) -> tuple[Rows, Rows]:
    """Oriented faces (G, 3) of vertices (V,) that are used, and which of the given ones each of these is a
    copy of.

    faces: (F, 3), of any kind. Left out are those with a corner twice, those that are there twice, what an
    edge has beyond two, and what a strip with one side only has too much. Faces that run around against
    those across their edges are turned, the first of each part as it is. A vertex in which several fans of
    faces meet becomes one for each.
    """
    kept = _distinct(np.asarray(faces, np.int64).reshape(-1, 3))
    return _one_fan_a_vertex(_oriented(_two_an_edge(kept)))


def across_edges(faces: Rows) -> tuple[Rows, Rows]:
    """Pairs of half-edges (P,) that share an edge, by number: 3 f + c is the one of face f from corner c on.

    Of an edge with more than two faces, pairs of those that follow each other.
    """
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    same = np.flatnonzero((ends[order[1:]] == ends[order[:-1]]).all(axis=1))
    return order[same], order[same + 1]


def joined(one: Rows, other: Rows, count: int) -> tuple[int, NDArray[np.int32]]:
    """How many parts `count` things fall into that pairs of numbers join, and the part of each, (count,)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = coo_array((np.ones(len(one), bool), (one, other)), shape=(count, count))
    parts, part = connected_components(links, directed=False)
    return int(parts), part


def _distinct(faces: Rows) -> Rows:
    corners = np.sort(faces, axis=1)
    faces, corners = (rows[(corners[:, 1:] != corners[:, :-1]).all(axis=1)] for rows in (faces, corners))
    return faces[np.sort(np.unique(corners, axis=0, return_index=True)[1])]


def _two_an_edge(faces: Rows) -> Rows:
    before, after = across_edges(faces)
    has_before = np.zeros(3 * len(faces), bool)
    has_before[after] = True
    return np.delete(faces, after[has_before[before]] // 3, axis=0)


def _oriented(faces: Rows) -> Rows:
    """Found by giving each face two sides and joining those across the edges of a tree: where both faces run
    against each other along the edge, the same ones. Of faces that still run along each other, one goes."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import minimum_spanning_tree

    count = len(faces)
    before, after = across_edges(faces)
    pairs, first = np.unique(np.stack([before // 3, after // 3], axis=1), axis=0, return_index=True)
    graph = coo_array(
        (first + 1.0, (pairs[:, 0], pairs[:, 1])), shape=(count, count)
    )  # the tree has the first
    kept = minimum_spanning_tree(graph.tocsr()).data.astype(np.int64) - 1
    same = faces.ravel()[before[kept]] != faces.ravel()[after[kept]]
    f, g = before[kept] // 3, after[kept] // 3
    other = np.where(same, g, g + count), np.where(same, g + count, g)
    _, side = joined(np.concatenate([f, f + count]), np.concatenate(other), 2 * count)
    turned = side[:count] > side[count:]
    faces = np.where(turned[:, None], faces[:, ::-1], faces)
    before, after = across_edges(faces)
    return np.delete(faces, after[faces.ravel()[before] == faces.ravel()[after]] // 3, axis=0)


def _one_fan_a_vertex(faces: Rows) -> tuple[Rows, Rows]:
    before, after = across_edges(faces)

    def following(half: Rows) -> Rows:
        return half - half % 3 + (half + 1) % 3

    one = np.concatenate([before, following(before)])
    other = np.concatenate([following(after), after])
    count, vertex = joined(one, other, faces.size)
    source = np.zeros(count, np.int64)
    source[vertex] = faces.ravel()
    return vertex.astype(np.int64).reshape(-1, 3), source
